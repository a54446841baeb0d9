//! What sealed cases and their scores promise, one file per subject. One program, which is linked once.

mod cases;
mod independence;
mod sealing;
mod truth;
mod twins;
