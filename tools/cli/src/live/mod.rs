//! `stillbeam live`: a board on a local page.
//!
//! ```text
//!   board ── session ── board_side ── frames, 30 a second ──▶ pages ──▶ any number of browsers
//!              ▲            ▲  └───── every sample ──▶ kept ──▶ recording
//!              │            └──────── orders, at most 8 ── routes ◀── the page that controls
//!              └── stop line, past all of it ──────────── routes ◀── any page with the token
//! ```
//!
//! | sentence | file |
//! |---|---|
//! | one thread owns the conversation with the board | [`board_side`] |
//! | what that thread and those that serve pages share is bounded | [`desk`] |
//! | who is answered at all | [`access`], [`secret`] |
//! | one page controls, the others watch | [`control`], [`pages`] |
//! | what is answered at which address | [`routes`] |
//! | what a page may ask of the board | [`orders`] |
//! | what it is shown | [`frame`], [`picture`], [`settings`], [`preview`], [`response`] |
//! | every sample is kept for the recording | [`kept`] |

pub mod access;
pub mod board_side;
pub mod control;
pub mod desk;
mod error;
pub mod frame;
pub mod kept;
pub mod orders;
pub mod pages;
pub mod picture;
pub mod preview;
pub mod response;
pub mod routes;
pub mod secret;
pub mod settings;

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use axum::serve::ListenerExt;
use tokio::runtime::{Builder, Runtime};

use crate::board::{ByteLink, Session, StopLine};
use crate::error::CliError;

pub use error::LiveError;

use board_side::BoardSide;
use desk::{BoardFacts, Desk};
use secret::Secret;

/// Samples per second that every line carries. Where ticks come faster, every second or fourth is streamed.
const MOST_SAMPLES_PER_S: f64 = 5000.0;

/// Threads that serve pages. A page that takes long does not hold up a stop that comes by another.
const SERVERS: usize = 2;

/// How long pages get to take leave.
const LEAVE: Duration = Duration::from_secs(1);

/// How a live page is served.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveOptions {
    /// The port to listen on; 0 for any that is free.
    pub port: u16,
    /// Where recordings are saved.
    pub folder: PathBuf,
    /// Whether nothing is wired to the board.
    pub is_virtual: bool,
}

/// Serves the board behind `link` until `closing` is set, on this thread and a few for the pages. `opened` is
/// told the address.
///
/// # Errors
/// [`LiveError`] when the page cannot be served, [`crate::board::BoardError`] when the board fails.
pub fn serve(
    link: Box<dyn ByteLink>,
    options: &LiveOptions,
    closing: &AtomicBool,
    opened: &mut dyn FnMut(&str),
) -> Result<(), CliError> {
    // Before the board is talked to, so that nothing is begun that cannot be watched.
    let listener = listen(options.port)?;
    let listening = listener.local_addr();
    let address = listening.map_err(|source| LiveError::Listen { port: options.port, source })?;
    let token = Secret::new()?;
    let stops = StopLine::default();
    let mut session = Session::start_with_stop_line(link, stops.clone())?;
    let tick_hz = session.tick_hz()?;
    let decimation = (tick_hz / MOST_SAMPLES_PER_S).ceil().max(1.0) as u32;
    let facts = BoardFacts { name: session.board().to_owned(), tick_hz, decimation };
    let (desk, letters) = Desk::new((token, address.port()), options.folder.clone(), facts, stops);
    let desk = Arc::new(desk);
    let board = BoardSide::new(session, Arc::clone(&desk), letters, options.is_virtual)?;
    let runtime = start_serving(listener, &desk)?;
    opened(&format!("http://{address}/{}/", desk.token.reveal()));
    let ended = board.run(closing);
    desk.end();
    runtime.shutdown_timeout(LEAVE);
    Ok(ended?)
}

/// The loopback address and no other.
fn listen(port: u16) -> Result<TcpListener, LiveError> {
    let refused = |source| LiveError::Listen { port, source };
    let listener = TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port))).map_err(refused)?;
    listener.set_nonblocking(true).map_err(refused)?;
    Ok(listener)
}

fn start_serving(listener: TcpListener, desk: &Arc<Desk>) -> Result<Runtime, LiveError> {
    let threads =
        Builder::new_multi_thread().worker_threads(SERVERS).max_blocking_threads(2).enable_all().build();
    let runtime = threads.map_err(|source| LiveError::Threads { source })?;
    let entered = runtime.enter();
    let listener = tokio::net::TcpListener::from_std(listener)
        .map_err(|source| LiveError::Listen { port: desk.port, source })?;
    drop(entered);
    // What is small goes out at once: a frame does not wait until the one before was acknowledged.
    let listener = listener.tap_io(|stream| {
        // Without it pages are a frame late.
        let _best_effort = stream.set_nodelay(true);
    });
    let (router, ending) = (routes::routes(desk), Arc::clone(desk));
    runtime.spawn(async move {
        let until = async move { ending.ended().await };
        // The server ends with the board; it has nothing to report.
        let _ended = axum::serve(listener, router).with_graceful_shutdown(until).await;
    });
    Ok(runtime)
}
