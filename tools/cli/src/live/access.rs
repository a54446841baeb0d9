//! Who is answered: pages of this server that know the token, and nobody else.
//!
//! | attack | what refuses it |
//! |---|---|
//! | another computer | the socket is bound to the loopback address |
//! | another user or program of this computer | the token in the path |
//! | a foreign page that sends requests here | `Origin` and `Sec-Fetch-Site` |
//! | a foreign name that was made to point here (DNS rebinding) | `Host` |
//! | a page that frames this one, or a script that got into it | the content security policy |

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::desk::Desk;

/// What decides over a request.
struct Asked<'r> {
    headers: &'r HeaderMap,
    path: &'r str,
    /// Whether it can change something or opens the stream.
    is_more_than_reading: bool,
}

/// Lets a request through or refuses it, and puts the policy of this server on every answer.
pub async fn guard(State(desk): State<Arc<Desk>>, request: Request, next: Next) -> Response {
    let opens_socket = request.headers().contains_key(header::UPGRADE);
    let asked = Asked {
        headers: request.headers(),
        path: request.uri().path(),
        is_more_than_reading: request.method() != Method::GET || opens_socket,
    };
    let mut response = match refusal(&asked, &desk) {
        None => next.run(request).await,
        Some((status, reason)) => (status, reason).into_response(),
    };
    put_policy(response.headers_mut(), desk.port);
    response
}

fn refusal(asked: &Asked<'_>, desk: &Desk) -> Option<(StatusCode, &'static str)> {
    let text = |name: HeaderName| asked.headers.get(name).map(HeaderValue::to_str);
    let host = match text(header::HOST) {
        Some(Ok(host)) if names(desk.port).iter().any(|name| name == host) => host,
        _ => {
            return Some((
                StatusCode::MISDIRECTED_REQUEST,
                "this page answers at 127.0.0.1 only; use the address that `stillbeam live` has printed\n",
            ));
        }
    };
    let is_own = |origin: &str| origin.strip_prefix("http://") == Some(host);
    let origin_is_wrong = match text(header::ORIGIN) {
        None => asked.is_more_than_reading,
        Some(origin) => !origin.is_ok_and(is_own),
    };
    let site = text(HeaderName::from_static("sec-fetch-site"));
    let site_is_wrong = site.is_some_and(|site| !matches!(site, Ok("same-origin" | "none")));
    if origin_is_wrong || site_is_wrong {
        return Some((StatusCode::FORBIDDEN, "only pages of this server may ask for that\n"));
    }
    let token = asked.path.split('/').nth(1).unwrap_or_default();
    if !desk.token.is(token) {
        return Some((
            StatusCode::FORBIDDEN,
            "the token in the address is missing or wrong; use the address that `stillbeam live` has printed\n",
        ));
    }
    None
}

/// What the server may be called.
fn names(port: u16) -> [String; 2] {
    [format!("127.0.0.1:{port}"), format!("localhost:{port}")]
}

fn put_policy(headers: &mut HeaderMap, port: u16) {
    // Some browsers do not count sockets among 'self'.
    let sockets = names(port).map(|name| format!("ws://{name}")).join(" ");
    let policy = format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self' {sockets}; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    if let Ok(policy) = HeaderValue::from_str(&policy) {
        headers.insert(header::CONTENT_SECURITY_POLICY, policy);
    }
    for (name, value) in [
        (header::CACHE_CONTROL, "no-store"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
}
