//! Answers queries for a station's news and rows, and carries out commands.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use serde::Deserialize as _;
use serde_json::{Value, json};
use tokio::sync::oneshot;
use zenoh::bytes::Encoding;
use zenoh::handlers::FifoChannelHandler;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::publishing::Told;
use super::rows::Place;
use super::{BridgeError, Member, failed, lock};
use crate::page::action::Action;
use crate::page::station::Answer;

/// Receives the queries of a station.
pub(super) struct Taking {
    member: Arc<Member>,
    queries: Queryable<FifoChannelHandler<Query>>,
}

/// A pending answer.
struct Awaited {
    query: Query,
    answer: oneshot::Receiver<Answer>,
    /// The client that gets the lease if it is granted.
    mover: Option<u64>,
}

impl Taking {
    pub(super) fn new(session: &Session, member: &Arc<Member>) -> Result<Self, BridgeError> {
        let queries = session.declare_queryable(format!("{}/*", member.key)).wait().map_err(failed)?;
        Ok(Self { member: Arc::clone(member), queries })
    }

    /// Starts to serve queries; a second thread waits for answers of the device.
    pub(super) fn start(self) -> Result<(), BridgeError> {
        let (awaited, answers) = channel();
        let member = Arc::clone(&self.member);
        let name = |what: &str| thread::Builder::new().name(format!("{} {what}", member.key));
        name("taking").spawn(move || self.run(&awaited))?;
        name("answering").spawn({
            let member = Arc::clone(&member);
            move || answer(&member, &answers)
        })?;
        Ok(())
    }

    fn run(self, awaited: &Sender<Awaited>) {
        while let Ok(query) = self.queries.recv() {
            let key = query.key_expr().as_str();
            match key.strip_prefix(&self.member.key) {
                Some("/command") => self.command(query, awaited),
                Some("/signals") => self.signals(&query),
                _ => self.last(&query),
            }
        }
    }

    /// Replies with the last news of each requested kind.
    fn last(&self, query: &Query) {
        let last = self.member.station.board().last();
        for told in last.iter().filter_map(|text| Told::read(text)) {
            let key = format!("{}/{}", self.member.key, told.key());
            let is_asked = zenoh::key_expr::KeyExpr::try_from(key.as_str())
                .is_ok_and(|key| query.key_expr().intersects(&key));
            if is_asked {
                // The client may be gone, here and below.
                let reply = query.reply(key, told.content.to_string());
                let _ = reply.encoding(Encoding::APPLICATION_JSON).wait();
            }
        }
    }

    /// Replies with the kept rows.
    fn signals(&self, query: &Query) {
        match place(query) {
            Ok(place) => {
                let rows = lock(&self.member.kept).after(place);
                let reply = query.reply(query.key_expr().clone(), rows);
                let _ = reply.encoding(Encoding::APPLICATION_OCTET_STREAM).wait();
            }
            Err(reason) => refuse(query, &reason),
        }
    }

    fn command(&self, query: Query, awaited: &Sender<Awaited>) {
        let station = &self.member.station;
        let (answer, mover) = match order(&query) {
            Ok(Order::Stop) => (station.stop(), None),
            Ok(Order::Do { client, action }) => {
                let mover = matches!(action, Action::Arm).then_some(client);
                (station.ask(client, action), mover)
            }
            Err(reason) => return refuse(&query, &reason),
        };
        // Fails only at the end of the bridge.
        let _ = awaited.send(Awaited { query, answer, mover });
    }
}

/// A command.
enum Order {
    /// Allowed for every client.
    Stop,
    Do {
        client: u64,
        action: Action,
    },
}

fn order(query: &Query) -> Result<Order, String> {
    const FORM: &str = r#"expected JSON such as {"client": "planner", "do": "arm"}"#;
    let bytes = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
    let value: Value =
        serde_json::from_slice(&bytes).map_err(|error| format!("invalid JSON: {error}; {FORM}"))?;
    let text = |key: &str| value.get(key).and_then(Value::as_str);
    if text("do") == Some("stop") {
        return Ok(Order::Stop);
    }
    let client =
        text("client").ok_or_else(|| format!("missing key \"client\", the name of the client; {FORM}"))?;
    let mut hasher = DefaultHasher::new();
    client.hash(&mut hasher);
    let action = Action::deserialize(&value).map_err(|error| format!("invalid command: {error}; {FORM}"))?;
    Ok(Order::Do { client: hasher.finish(), action })
}

/// The last row that the client has, if given.
fn place(query: &Query) -> Result<Option<Place>, String> {
    let number = |name: &str| {
        let text = query.parameters().get(name);
        let wrong = |text: &str| format!("query parameter {name}={text} must be a whole number");
        let number = text.map(|text| text.parse::<u32>().map_err(|_| wrong(text)));
        number.transpose()
    };
    match (number("layout")?, number("tick")?) {
        (Some(layout), Some(tick)) => Ok(Some(Place { layout, tick })),
        (None, None) => Ok(None),
        _ => {
            Err("incomplete query: give both layout and tick, such as signals?layout=1;tick=1000".to_owned())
        }
    }
}

/// Sends answers as they arrive.
fn answer(member: &Member, answers: &Receiver<Awaited>) {
    for Awaited { query, answer, mover } in answers {
        match answer.blocking_recv() {
            Ok(Ok(done)) => {
                if mover.is_some() {
                    *lock(&member.mover) = mover;
                }
                let reply = query.reply(query.key_expr().clone(), json!({ "done": done }).to_string());
                let _ = reply.encoding(Encoding::APPLICATION_JSON).wait();
            }
            Ok(Err(reason)) => refuse(&query, &reason),
            Err(_) => refuse(&query, "the device is disconnected"),
        }
    }
}

fn refuse(query: &Query, reason: &str) {
    let reply = query.reply_err(json!({ "refused": reason }).to_string());
    let _ = reply.encoding(Encoding::APPLICATION_JSON).wait();
}
