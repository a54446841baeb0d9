//! A page that is open: frames go to it as fast as it answers, never faster, and it says that it is there.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use serde_json::json;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::timeout;

use super::control::PageNumber;
use super::desk::Desk;

/// Frames that a page may leave unanswered before it gets no more.
const MOST_UNANSWERED: u32 = 8;

/// How long a page may be silent before it is dropped.
const DROPPED_AFTER: Duration = Duration::from_secs(10);

/// How long a frame may take to be taken by the system.
const SEND_PATIENCE: Duration = Duration::from_secs(1);

/// A page's words: it has drawn what it was sent, or its clock has ticked.
const HERE: &str = "here";

/// A page's words: stop.
const STOP: &str = "stop";

/// Serves a page until it goes, is silent for too long, or everything ends.
pub async fn watch(mut socket: WebSocket, desk: Arc<Desk>) {
    let entered = desk.control().enter(Instant::now());
    let (number, name) = match entered {
        Ok(Some(entered)) => entered,
        Ok(None) => return refuse(&mut socket, "too many pages are open; close one").await,
        Err(error) => return refuse(&mut socket, &error.to_string()).await,
    };
    let hello = json!({ "page": name.reveal() }).to_string();
    if send(&mut socket, hello.into()).await {
        serve(&mut socket, &desk, number).await;
    }
    desk.control().leave(number);
}

async fn serve(socket: &mut WebSocket, desk: &Desk, number: PageNumber) {
    let mut frames = desk.frames();
    let (mut unanswered, mut heard) = (0, Instant::now());
    while heard.elapsed() < DROPPED_AFTER {
        tokio::select! {
            // What a page says comes before what it is told, a stop above all.
            biased;
            message = socket.recv() => match message {
                Some(Ok(Message::Text(words))) => {
                    match words.as_str() {
                        STOP => desk.stops.pull(),
                        HERE => unanswered = 0,
                        _ => return,
                    }
                    heard = Instant::now();
                    desk.control().hear(number, heard);
                }
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                _ => return,
            },
            () = desk.ended() => return,
            frame = frames.recv() => match frame {
                Ok(frame) if unanswered < MOST_UNANSWERED => {
                    unanswered += 1;
                    if !send(socket, frame).await {
                        return;
                    }
                }
                Ok(_) | Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return,
            },
        }
    }
}

/// Sends words; whether the page has taken them.
async fn send(socket: &mut WebSocket, words: Utf8Bytes) -> bool {
    matches!(timeout(SEND_PATIENCE, socket.send(Message::Text(words))).await, Ok(Ok(())))
}

async fn refuse(socket: &mut WebSocket, why: &str) {
    // A page that has gone needs no reason.
    let _told = send(socket, json!({ "refused": why }).to_string().into()).await;
}
