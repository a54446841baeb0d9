//! What is answered at which address. All of them begin with the token.

use std::sync::Arc;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{DefaultBodyLimit, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router, middleware};
use serde::Deserialize;
use serde_json::json;
use stillbeam_recording::write_csv;

use super::access::guard;
use super::desk::Desk;
use super::orders::Order;
use super::pages::watch;
use super::preview::{AskedMode, Preview, modes};
use super::response::GrowingResponse;
use crate::board_recording::recording;

/// Bytes of the largest request.
const MOST_BYTES: usize = 4096;

/// Bytes of the largest message over a socket.
const MOST_MESSAGE_BYTES: usize = 256;

/// Where a page says its name.
const PAGE_HEADER: &str = "x-stillbeam-page";

/// Everything that is served.
pub fn routes(desk: &Arc<Desk>) -> Router {
    let file = |kind: &'static str, text: &'static str| {
        get(move || async move { ([(header::CONTENT_TYPE, kind)], text) })
    };
    let files = [
        ("/{token}/", "text/html; charset=utf-8", include_str!("page.html")),
        ("/{token}/page.css", "text/css; charset=utf-8", include_str!("page.css")),
        ("/{token}/page.js", "text/javascript; charset=utf-8", include_str!("page.js")),
        ("/{token}/panels.js", "text/javascript; charset=utf-8", include_str!("panels.js")),
        ("/{token}/curves.js", "text/javascript; charset=utf-8", include_str!("curves.js")),
        ("/{token}/icon.svg", "image/svg+xml", include_str!("icon.svg")),
    ];
    let with_files = files
        .into_iter()
        .fold(Router::new(), |router, (path, kind, text)| router.route(path, file(kind, text)));
    with_files
        .route("/{token}/socket", get(socket))
        .route("/{token}/board", get(board))
        .route("/{token}/stop", post(stop))
        .route("/{token}/control", post(take_control))
        .route("/{token}/control/release", post(release_control))
        .route("/{token}/order", post(order))
        .route("/{token}/preview", post(preview))
        .route("/{token}/response", post(response))
        .route("/{token}/recording/anew", post(record_anew))
        .route("/{token}/recording/save", post(save_recording))
        .layer(DefaultBodyLimit::max(MOST_BYTES))
        .layer(middleware::from_fn_with_state(Arc::clone(desk), guard))
        .with_state(Arc::clone(desk))
}

type Shared = State<Arc<Desk>>;

/// An answer in words: 200, or 409 where it was not done.
fn answer(done: Result<String, String>) -> Response {
    match done {
        Ok(told) => Json(json!({ "told": told })).into_response(),
        Err(refused) => (StatusCode::CONFLICT, Json(json!({ "refused": refused }))).into_response(),
    }
}

fn page_name(headers: &HeaderMap) -> &str {
    headers.get(PAGE_HEADER).and_then(|name| name.to_str().ok()).unwrap_or_default()
}

/// Refuses whoever does not control.
fn controls(desk: &Desk, headers: &HeaderMap) -> Result<(), String> {
    let mut control = desk.control();
    // One that was silent for too long has lost it.
    control.holder(Instant::now());
    match control.is_holder(page_name(headers)) {
        true => Ok(()),
        false => Err("this page only watches; press \"take control\" first".to_owned()),
    }
}

async fn socket(State(desk): Shared, upgrade: WebSocketUpgrade) -> Response {
    upgrade
        .max_message_size(MOST_MESSAGE_BYTES)
        .max_frame_size(MOST_MESSAGE_BYTES)
        .on_upgrade(move |socket| watch(socket, desk))
}

/// What a page has to know before it draws.
async fn board(State(desk): Shared) -> Response {
    let facts = &desk.facts;
    let told = json!({
        "board": facts.name,
        "tick_hz": facts.tick_hz,
        "ticks_per_sample": facts.decimation,
        "settings": *desk.settings(),
    });
    Json(told).into_response()
}

/// Whoever knows the token may stop.
async fn stop(State(desk): Shared) -> Response {
    let tick = desk.tick();
    desk.stops.pull();
    Json(json!({ "told": "stopping", "tick": tick })).into_response()
}

async fn take_control(State(desk): Shared, headers: HeaderMap) -> Response {
    let has_it = desk.control().take(page_name(&headers), Instant::now());
    answer(match has_it {
        true => Ok("this page controls".to_owned()),
        false => Err("another page controls; it has to be closed or give up control first".to_owned()),
    })
}

async fn release_control(State(desk): Shared, headers: HeaderMap) -> Response {
    desk.control().give_up(page_name(&headers));
    answer(Ok("this page watches".to_owned()))
}

async fn order(State(desk): Shared, headers: HeaderMap, Json(order): Json<Order>) -> Response {
    answer(match controls(&desk, &headers) {
        Ok(()) => desk.order(order).await,
        refused => refused.map(|()| String::new()),
    })
}

/// The modes of a shaper that is only looked at.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct AskedShaper {
    modes: Vec<AskedMode>,
}

async fn preview(State(desk): Shared, Json(asked): Json<AskedShaper>) -> Response {
    let rate_hz = desk.facts.tick_hz;
    let previewed =
        at_work(&desk, move || modes(&asked.modes).and_then(|modes| Preview::new(&modes, rate_hz))).await;
    match previewed {
        Ok(preview) => Json(preview).into_response(),
        Err(refused) => answer(Err(refused)),
    }
}

/// What the last sweep has shown so far.
async fn response(State(desk): Shared) -> Response {
    let shared = Arc::clone(&desk);
    let shown = at_work(&desk, move || {
        let sweep = shared.sweep().ok_or_else(|| "there was no sweep yet; begin one".to_owned())?;
        // The lock is gone before the arithmetic begins.
        let samples = shared.kept().since(sweep.first_tick);
        GrowingResponse::new(&sweep, &samples, shared.facts.tick_hz)
    });
    match shown.await {
        Ok(shown) => Json(shown).into_response(),
        Err(refused) => answer(Err(refused)),
    }
}

/// Does what takes long beside the threads that serve, one of it at a time.
async fn at_work<T: Send + 'static>(
    desk: &Desk,
    work: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T, String> {
    let Ok(permit) = Arc::clone(&desk.work).acquire_owned().await else {
        return Err("stillbeam live has ended; start it again".to_owned());
    };
    let worked = tokio::task::spawn_blocking(move || {
        let done = work();
        drop(permit);
        done
    });
    worked.await.unwrap_or_else(|_| Err("it could not be computed; please report it".to_owned()))
}

async fn record_anew(State(desk): Shared, headers: HeaderMap) -> Response {
    let may = controls(&desk, &headers);
    answer(may.map(|()| {
        *desk.kept() = Default::default();
        "the recording begins now".to_owned()
    }))
}

/// Writes what is kept into the folder that the command line has named, under the time of now.
async fn save_recording(State(desk): Shared, headers: HeaderMap) -> Response {
    if let Err(refused) = controls(&desk, &headers) {
        return answer(Err(refused));
    }
    let shared = Arc::clone(&desk);
    let saved = at_work(&desk, move || {
        // A copy of what is shared by blocks, so that the board's thread waits for a moment only.
        let kept = shared.kept().clone();
        if kept.is_empty() {
            return Err("there are no samples yet; wait until the chart moves".to_owned());
        }
        let streamed = kept.streamed(shared.facts.tick_hz, shared.facts.decimation);
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let path = shared.folder.join(format!("live_{}.csv", now.as_millis()));
        let name = path.display().to_string();
        let saved = write_csv(&path, &recording(&name, "live", &streamed));
        saved.map(|()| format!("saved {} samples as {name}", kept.len())).map_err(|error| error.to_string())
    });
    answer(saved.await)
}
