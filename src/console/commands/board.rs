//! What concerns the board itself: `reboot`, `dfu`, `selftest`, `brownout`.

use core::fmt::Write;

use super::say;
use super::words::{Words, no_more};
use crate::brown_out::BrownOut;
use crate::console::error::CommandError;
use crate::console::{Console, Effect};
use crate::restart::Start;
use crate::self_test::SelfTest;

impl Console<'_> {
    /// `reboot` and `dfu`.
    pub(super) fn reboot(
        &mut self,
        command: &'static str,
        start: Start,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'static>> {
        self.require_still(command)?;
        say(out, format_args!("ok {command}"));
        self.effect = Some(Effect::Reboot(start));
        Ok(())
    }

    /// Asks the board to test itself. The reply comes when it has.
    pub(super) fn test_board(&mut self) -> Result<(), CommandError<'static>> {
        const COMMAND: &str = "selftest";
        self.require_drive_off(COMMAND)?;
        self.require_still(COMMAND)?;
        self.effect = Some(Effect::SelfTest);
        Ok(())
    }

    /// Ends the reply to `selftest`, with the tick's time beside what the board has found.
    pub fn self_tested(&mut self, mut test: SelfTest, out: &mut dyn Write) {
        if let Some([_, worst, period]) = self.tick_cycles() {
            test.note("tick_cycles", (1, period.cast_signed()), Some(worst.cast_signed()));
        }
        self.reply(out, |_, out| {
            say(out, format_args!("{}", SelfTest::HEADING));
            for check in test.checks() {
                say(out, format_args!("{check}"));
            }
            let (failed, all) = (test.failed(), test.checks().len());
            say(out, format_args!("ok selftest passed={} failed={failed}", all - failed));
        });
        self.prompt(out);
    }

    /// Asks the board to write a brown-out level. The reply comes when it has.
    pub(super) fn set_brown_out<'l>(&mut self, mut words: Words<'l>) -> Result<(), CommandError<'l>> {
        const COMMAND: &str = "brownout";
        const USAGE: &str = "brownout set off|level_1|level_2|level_3";
        let usage = CommandError::Usage { command: COMMAND, usage: USAGE };
        let (Some("set"), Some(name)) = (words.next(), words.next()) else { return Err(usage) };
        no_more(words, COMMAND, USAGE)?;
        let level = BrownOut::from_name(name).ok_or(usage)?;
        // The chip stands still meanwhile.
        self.require_drive_off(COMMAND)?;
        self.effect = Some(Effect::SetBrownOut(level));
        Ok(())
    }

    /// Ends the reply to `brownout set`, with the level that the option bytes say then.
    pub fn brown_out_set(&mut self, wanted: BrownOut, found: BrownOut, out: &mut dyn Write) {
        self.identity.brown_out = Some(found);
        self.reply(out, |_, out| {
            if found == wanted {
                say(out, format_args!("ok brownout level={found}"));
            } else {
                say(out, format_args!("{}", CommandError::BrownOut { found }));
            }
        });
        self.prompt(out);
    }
}
