//! The page: observe, tune and move controllers from a browser on this computer.
//!
//! ```text
//! browser ◀─WebSocket─▶ client ◀──▶ Station: four lines to one controller, as `dimsart connect` has one
//! ```
//! The page never delays a tick: a station is an ordinary client of the broker. Motion requires the lease, whose renewals
//! end when the browser closes or is silent.
//!
//! The server listens only on this computer. A request needs the token of the printed address, and a WebSocket also the
//! page's own origin: other sites and other users' programs are refused. After the server has ended, an open page sends its
//! token to any program that listens on its port: on a shared computer, close the page first.

pub(crate) mod action;
mod client;
mod connections;
pub(crate) mod news;
mod page_device;
mod recorded;
pub(crate) mod station;
mod token;
mod tuning;

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{ConnectInfo, DefaultBodyLimit, Query, Request, State, WebSocketUpgrade};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use dimsart_core::ModuleKinds;
use serde::Deserialize;

use connections::{Connections, HasSocket};
pub use page_device::{OpenLine, ReferenceOverrideFn};
pub use recorded::Recording;
pub use station::{Access, Station};

/// Files of the page: path, type, content.
const ASSETS: [(&str, &str, &str); 39] = [
    ("/page.css", "text/css", include_str!("page/assets/page.css")),
    ("/page.js", "text/javascript", include_str!("page/assets/page.js")),
    ("/adding.js", "text/javascript", include_str!("page/assets/adding.js")),
    ("/cursors.js", "text/javascript", include_str!("page/assets/cursors.js")),
    ("/decimate.js", "text/javascript", include_str!("page/assets/decimate.js")),
    ("/device.js", "text/javascript", include_str!("page/assets/device.js")),
    ("/dom.js", "text/javascript", include_str!("page/assets/dom.js")),
    ("/export.js", "text/javascript", include_str!("page/assets/export.js")),
    ("/fleet.js", "text/javascript", include_str!("page/assets/fleet.js")),
    ("/fourier.js", "text/javascript", include_str!("page/assets/fourier.js")),
    ("/gains.js", "text/javascript", include_str!("page/assets/gains.js")),
    ("/kinematics.js", "text/javascript", include_str!("page/assets/kinematics.js")),
    ("/layouts.js", "text/javascript", include_str!("page/assets/layouts.js")),
    ("/math.js", "text/javascript", include_str!("page/assets/math.js")),
    ("/modules.js", "text/javascript", include_str!("page/assets/modules.js")),
    ("/pending.js", "text/javascript", include_str!("page/assets/pending.js")),
    ("/plots.js", "text/javascript", include_str!("page/assets/plots.js")),
    ("/presets.js", "text/javascript", include_str!("page/assets/presets.js")),
    ("/recording.js", "text/javascript", include_str!("page/assets/recording.js")),
    ("/request.js", "text/javascript", include_str!("page/assets/request.js")),
    ("/ring.js", "text/javascript", include_str!("page/assets/ring.js")),
    ("/robot.js", "text/javascript", include_str!("page/assets/robot.js")),
    ("/robots.js", "text/javascript", include_str!("page/assets/robots.js")),
    ("/rows.js", "text/javascript", include_str!("page/assets/rows.js")),
    ("/scheme.js", "text/javascript", include_str!("page/assets/scheme.js")),
    ("/scope.js", "text/javascript", include_str!("page/assets/scope.js")),
    ("/sending.js", "text/javascript", include_str!("page/assets/sending.js")),
    ("/signal_list.js", "text/javascript", include_str!("page/assets/signal_list.js")),
    ("/sources.js", "text/javascript", include_str!("page/assets/sources.js")),
    ("/step_figures.js", "text/javascript", include_str!("page/assets/step_figures.js")),
    ("/stored.js", "text/javascript", include_str!("page/assets/stored.js")),
    ("/three.min.js", "text/javascript", include_str!("page/assets/three.min.js")),
    ("/traces.js", "text/javascript", include_str!("page/assets/traces.js")),
    ("/trigger.js", "text/javascript", include_str!("page/assets/trigger.js")),
    ("/tuning.js", "text/javascript", include_str!("page/assets/tuning.js")),
    ("/uplot.css", "text/css", include_str!("page/assets/uPlot.min.css")),
    ("/uplot.js", "text/javascript", include_str!("page/assets/uPlot.iife.min.js")),
    ("/view.js", "text/javascript", include_str!("page/assets/view.js")),
    ("/xy.js", "text/javascript", include_str!("page/assets/xy.js")),
];
const INDEX: &str = include_str!("page/assets/index.html");
/// The page loads no content from other hosts.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:";

/// Maximum size of a loaded or exported recording.
const MAX_RECORDING_BYTES: usize = 512 * 1024 * 1024;
/// Maximum length of a browser's message, such as the rows of a scheme.
const MAX_MESSAGE_BYTES: usize = 64 * 1024;

/// A page that is served until the program ends.
#[derive(Debug)]
pub struct Page {
    address: SocketAddr,
    site: Arc<Site>,
}

/// Shared state of all requests.
#[derive(Debug)]
struct Site {
    token: String,
    port: u16,
    stations: Vec<Station>,
    recordings: Vec<Recording>,
    /// Module kinds of this program.
    kinds: ModuleKinds,
}

impl Page {
    /// Listens on a port of this computer; 0 selects a free port.
    ///
    /// # Errors
    /// An error of the system, for example if the port is in use.
    pub fn listen(port: u16) -> io::Result<TcpListener> {
        TcpListener::bind((Ipv4Addr::LOCALHOST, port))
    }

    /// Serves the page of these controllers on a [listener](Self::listen); trials of gains use the module `kinds`.
    ///
    /// # Errors
    /// An error of the system.
    pub fn serve(stations: Vec<Station>, kinds: ModuleKinds, listener: TcpListener) -> io::Result<Self> {
        Self::start(stations, Vec::new(), kinds, listener)
    }

    /// Serves the scope of recordings on a [listener](Self::listen): the first is shown, the others are compared with it.
    ///
    /// # Errors
    /// An error of the system.
    pub fn view(recordings: Vec<Recording>, kinds: ModuleKinds, listener: TcpListener) -> io::Result<Self> {
        Self::start(Vec::new(), recordings, kinds, listener)
    }

    fn start(
        stations: Vec<Station>,
        recordings: Vec<Recording>,
        kinds: ModuleKinds,
        listener: TcpListener,
    ) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let token = token::token()?;
        let site = Arc::new(Site { token, port: address.port(), stations, recordings, kinds });
        let served = Arc::clone(&site);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        thread::spawn(move || {
            runtime.block_on(async move {
                let connections = Connections::new(tokio::net::TcpListener::from_std(listener)?);
                let router = router(served).into_make_service_with_connect_info::<HasSocket>();
                axum::serve(connections, router).await
            })
        });
        Ok(Self { address, site })
    }

    /// Returns the address to open, with the token.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.site.token)
    }

    /// Ends all recordings with complete files, and returns their summaries. Called before the program ends.
    #[must_use]
    pub fn end_recordings(&self) -> Vec<String> {
        self.site.stations.iter().filter_map(Station::end_recording).collect()
    }
}

fn router(site: Arc<Site>) -> Router {
    let mut router = Router::new()
        .route("/", get(index))
        .route("/socket", get(socket))
        .route("/recorded", get(recorded))
        .route("/replayed", get(replayed))
        .route("/recording", post(load_recording))
        .route("/export", post(export))
        .route("/identify", post(identify))
        .route("/trial", post(trial))
        .layer(DefaultBodyLimit::max(MAX_RECORDING_BYTES));
    for (path, kind, content) in ASSETS {
        router = router.route(path, get(move || async move { ([(header::CONTENT_TYPE, kind)], content) }));
    }
    router.layer(middleware::from_fn_with_state(Arc::clone(&site), guard)).with_state(site)
}

/// Refuses requests with a foreign host name, which DNS rebinding would send.
async fn guard(State(site): State<Arc<Site>>, request: Request, next: Next) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok());
    if !host.is_some_and(|host| site.names().iter().any(|name| name == host)) {
        return (StatusCode::FORBIDDEN, "this page is available only at 127.0.0.1 and localhost")
            .into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    response
}

#[derive(Deserialize)]
struct Entry {
    token: Option<String>,
    /// Number of a recording.
    #[serde(default)]
    number: usize,
}

async fn index(State(site): State<Arc<Site>>, Query(entry): Query<Entry>) -> Response {
    match site.lets_in(&entry) {
        true => ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], INDEX).into_response(),
        false => no_token(),
    }
}

async fn socket(
    State(site): State<Arc<Site>>,
    Query(entry): Query<Entry>,
    ConnectInfo(has_socket): ConnectInfo<HasSocket>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let origin = headers.get(header::ORIGIN).and_then(|origin| origin.to_str().ok());
    let is_ours = origin.and_then(|origin| origin.strip_prefix("http://"));
    if !is_ours.is_some_and(|origin| site.names().iter().any(|name| name == origin)) {
        return (StatusCode::FORBIDDEN, "WebSocket refused: the origin of the request is not this page")
            .into_response();
    }
    if !site.lets_in(&entry) {
        return no_token();
    }
    has_socket.set();
    let upgrade = upgrade.max_message_size(MAX_MESSAGE_BYTES);
    upgrade
        .on_upgrade(move |socket| async move { client::talk(socket, &site.stations, &site.recordings).await })
}

/// Sends the signals of a recording that the page shows.
async fn recorded(
    State(site): State<Arc<Site>>,
    Query(entry): Query<Entry>,
    ConnectInfo(has_socket): ConnectInfo<HasSocket>,
) -> Response {
    match (site.lets_in(&entry), site.recordings.get(entry.number)) {
        (false, _) => no_token(),
        (true, Some(recording)) => {
            has_socket.set();
            binary(recording.bytes.to_vec())
        }
        (true, None) => (StatusCode::NOT_FOUND, "unknown recording: reload the page").into_response(),
    }
}

/// Sends the result of a recording's replay; status 202 until it is finished.
async fn replayed(State(site): State<Arc<Site>>, Query(entry): Query<Entry>) -> Response {
    if !site.lets_in(&entry) {
        return no_token();
    }
    let replayed = site.recordings.get(entry.number).and_then(|recording| recording.replayed.get());
    match replayed.map(serde_json::to_string) {
        Some(Ok(json)) => json.into_response(),
        _ => StatusCode::ACCEPTED.into_response(),
    }
}

/// Reads an uploaded recording, and sends its signals.
async fn load_recording(
    State(site): State<Arc<Site>>,
    Query(entry): Query<Entry>,
    ConnectInfo(has_socket): ConnectInfo<HasSocket>,
    content: Bytes,
) -> Response {
    answer(&site, &entry, &has_socket, move || recorded::load(&content)).await
}

/// Writes signals of the page as MCAP.
async fn export(
    State(site): State<Arc<Site>>,
    Query(entry): Query<Entry>,
    ConnectInfo(has_socket): ConnectInfo<HasSocket>,
    content: Bytes,
) -> Response {
    let write = move || {
        let export: recorded::Export = serde_json::from_slice(&content).map_err(|error| error.to_string())?;
        export.mcap().map_err(|error| error.to_string())
    };
    answer(&site, &entry, &has_socket, write).await
}

/// Identifies a joint from rows.
async fn identify(
    State(site): State<Arc<Site>>,
    Query(entry): Query<Entry>,
    ConnectInfo(has_socket): ConnectInfo<HasSocket>,
    content: Bytes,
) -> Response {
    let identify = move || {
        let rows: tuning::Rows = serde_json::from_slice(&content).map_err(|error| error.to_string())?;
        serde_json::to_vec(&rows.identify()?).map_err(|error| error.to_string())
    };
    answer(&site, &entry, &has_socket, identify).await
}

/// Simulates a step with an identified joint, and sends its signals.
async fn trial(
    State(site): State<Arc<Site>>,
    Query(entry): Query<Entry>,
    ConnectInfo(has_socket): ConnectInfo<HasSocket>,
    content: Bytes,
) -> Response {
    let kinds = site.kinds;
    let simulate = move || {
        let trial: tuning::Trial = serde_json::from_slice(&content).map_err(|error| error.to_string())?;
        Ok(recorded::encode(&[trial.run(kinds)?]))
    };
    answer(&site, &entry, &has_socket, simulate).await
}

/// Does the work of a request that has the token, and sends its result or the reason of its refusal. A STOP does not wait for
/// the work.
async fn answer(
    site: &Site,
    entry: &Entry,
    has_socket: &HasSocket,
    work: impl FnOnce() -> Result<Vec<u8>, String> + Send + 'static,
) -> Response {
    if !site.lets_in(entry) {
        return no_token();
    }
    has_socket.set();
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(bytes)) => binary(bytes),
        Ok(Err(reason)) => (StatusCode::BAD_REQUEST, reason).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

fn binary(bytes: Vec<u8>) -> Response {
    // Without a time limit, the connection must not stay open.
    ([(header::CONTENT_TYPE, "application/octet-stream"), (header::CONNECTION, "close")], bytes)
        .into_response()
}

fn no_token() -> Response {
    let text = "missing or invalid token: open the address printed by `dimsart serve`";
    (StatusCode::UNAUTHORIZED, text).into_response()
}

impl Site {
    /// Returns the valid host names of this server.
    fn names(&self) -> [String; 2] {
        ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port))
    }

    fn lets_in(&self, entry: &Entry) -> bool {
        entry.token.as_deref() == Some(self.token.as_str())
    }
}
