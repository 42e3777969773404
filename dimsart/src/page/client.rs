//! A browser: its requests, and the news sent to it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::extract::ws::{Message, WebSocket};
use futures_util::{SinkExt as _, StreamExt as _};
use serde::{Deserialize, Serialize};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{Semaphore, mpsc};

use super::action::Action;
use super::news::News;
use super::recorded::Recording;
use super::station::{Answer, Station};

/// Capacity of the send queue; a browser misses news when it is full.
const ROOM: usize = 64;
/// Maximum number of unread answers; further answers are lost, but their requests are carried out.
const MAX_ANSWERS: usize = 64;
/// Id of the answer to an invalid message.
const NO_ID: u32 = 0;

/// A message of a browser.
#[derive(Debug, Deserialize)]
#[serde(tag = "say", rename_all = "snake_case")]
enum Said {
    /// Presence, sent repeatedly while the browser moves a device.
    Here,
    /// Immediate STOP.
    Stop { id: u32, station: usize },
    /// A requested action.
    Do {
        id: u32,
        station: usize,
        #[serde(flatten)]
        action: Action,
    },
}

#[derive(Serialize)]
struct Answered {
    kind: &'static str,
    id: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    done: Option<serde_json::Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
}

/// Serves a browser until it disconnects, which ends its motion.
pub(super) async fn talk(mut socket: WebSocket, stations: &[Station], recordings: &[Recording]) {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let client = NEXT.fetch_add(1, Ordering::Relaxed);
    let (out, mut outgoing) = mpsc::channel::<Message>(ROOM);
    let names: Vec<&str> = stations.iter().map(Station::name).collect();
    let version = env!("CARGO_PKG_VERSION");
    let recordings: Vec<&str> = recordings.iter().map(|recording| recording.name.as_str()).collect();
    let hello = serde_json::json!({
        "kind": "hello", "stations": names, "recordings": recordings, "client": client, "version": version
    });
    if socket.send(Message::text(hello.to_string())).await.is_err() {
        return;
    }
    for (number, station) in stations.iter().enumerate() {
        let board = Arc::clone(station.board());
        let (last, mut news) = board.read();
        for text in last {
            if socket.send(Message::text(text.as_ref())).await.is_err() {
                return;
            }
        }
        let out = out.clone();
        tokio::spawn(async move {
            loop {
                let message = match news.recv().await {
                    Ok(News::Text(text)) => Message::text(text.as_ref()),
                    Ok(News::Rows(rows)) => match rows.bytes() {
                        Some(bytes) => Message::binary(bytes),
                        None => continue,
                    },
                    Ok(News::Discontinuity(_)) => continue,
                    Err(RecvError::Lagged(missed)) => {
                        for text in board.last() {
                            if out.send(Message::text(text.as_ref())).await.is_err() {
                                return;
                            }
                        }
                        Message::text(
                            serde_json::json!({ "kind": "missed", "station": number, "content": missed })
                                .to_string(),
                        )
                    }
                    Err(RecvError::Closed) => return,
                };
                if out.send(message).await.is_err() {
                    return;
                }
            }
        });
    }
    // Requests are received even if the browser does not read: one may be STOP.
    let (mut sending, mut receiving) = socket.split();
    let telling = tokio::spawn(async move {
        while let Some(message) = outgoing.recv().await {
            if sending.send(message).await.is_err() {
                return;
            }
        }
    });
    let answers = Arc::new(Semaphore::new(MAX_ANSWERS));
    while let Some(Ok(said)) = receiving.next().await {
        match said {
            Message::Text(text) => hear(&text, client, stations, &out, &answers),
            Message::Close(_) => break,
            _ => {}
        }
    }
    telling.abort();
    stations.iter().for_each(|station| station.hear(client, false));
}

fn hear(
    text: &str,
    client: u64,
    stations: &[Station],
    out: &mpsc::Sender<Message>,
    answers: &Arc<Semaphore>,
) {
    let (id, answered) = match serde_json::from_str(text) {
        Ok(Said::Here) => return stations.iter().for_each(|station| station.hear(client, true)),
        Ok(Said::Stop { id, station }) => (id, stations.get(station).map(Station::stop)),
        Ok(Said::Do { id, station, action }) => {
            (id, stations.get(station).map(|station| station.ask(client, action)))
        }
        Err(error) => {
            let refused = message(NO_ID, Err(format!("invalid message: {error}")));
            // The queue of a browser that does not read is full.
            return drop(refused.map(|refused| out.try_send(refused)));
        }
    };
    let (Ok(place), out) = (Arc::clone(answers).try_acquire_owned(), out.clone()) else { return };
    tokio::spawn(async move {
        let done = match answered {
            Some(answered) => {
                answered.await.unwrap_or_else(|_| Err("no connection to the device".to_owned()))
            }
            None => Err("unknown station: reload the page".to_owned()),
        };
        if let Some(message) = message(id, done) {
            // The browser may have disconnected.
            let _ = out.send(message).await;
        }
        drop(place);
    });
}

fn message(id: u32, answer: Answer) -> Option<Message> {
    let (done, refused) = match answer {
        Ok(done) => (Some(done), None),
        Err(refused) => (None, Some(refused)),
    };
    serde_json::to_string(&Answered { kind: "answer", id, done, refused }).ok().map(Message::text)
}
