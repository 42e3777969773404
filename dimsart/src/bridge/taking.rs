//! What is asked of a station, and what it is told to do: a query each, and its answer.

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

/// Takes the queries of a station.
pub(super) struct Taking {
    member: Arc<Member>,
    queries: Queryable<FifoChannelHandler<Query>>,
}

/// An answer that is not there yet.
struct Awaited {
    query: Query,
    answer: oneshot::Receiver<Answer>,
    /// The client that has the lease if it is granted.
    mover: Option<u64>,
}

impl Taking {
    pub(super) fn new(session: &Session, member: &Arc<Member>) -> Result<Self, BridgeError> {
        let queries = session.declare_queryable(format!("{}/*", member.key)).wait().map_err(failed)?;
        Ok(Self { member: Arc::clone(member), queries })
    }

    /// Takes them from now on, each at once; what the device has to answer is waited for beside.
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

    /// The last news of each kind that is asked for.
    fn last(&self, query: &Query) {
        let last = self.member.station.board().last();
        for told in last.iter().filter_map(|text| Told::read(text)) {
            let key = format!("{}/{}", self.member.key, told.key());
            let is_asked = zenoh::key_expr::KeyExpr::try_from(key.as_str())
                .is_ok_and(|key| query.key_expr().intersects(&key));
            if is_asked {
                // Who asked may be gone, here as below.
                let reply = query.reply(key, told.content.to_string());
                let _ = reply.encoding(Encoding::APPLICATION_JSON).wait();
            }
        }
    }

    /// Rows that are kept.
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
        // It ends with the bridge alone.
        let _ = awaited.send(Awaited { query, answer, mover });
    }
}

/// What somebody wants to be done.
enum Order {
    /// By whomever.
    Stop,
    Do {
        client: u64,
        action: Action,
    },
}

fn order(query: &Query) -> Result<Order, String> {
    const FORM: &str = r#"a command is JSON such as {"client": "planner", "do": "arm"}"#;
    let bytes = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
    let value: Value = serde_json::from_slice(&bytes).map_err(|error| format!("{error}; {FORM}"))?;
    let text = |key: &str| value.get(key).and_then(Value::as_str);
    if text("do") == Some("stop") {
        return Ok(Order::Stop);
    }
    let client = text("client").ok_or_else(|| format!("\"client\" says who wants it; {FORM}"))?;
    let mut hasher = DefaultHasher::new();
    client.hash(&mut hasher);
    let action = Action::deserialize(&value).map_err(|error| format!("not understood: {error}; {FORM}"))?;
    Ok(Order::Do { client: hasher.finish(), action })
}

/// The row that one who asks has already, if it says so.
fn place(query: &Query) -> Result<Option<Place>, String> {
    let number = |name: &str| {
        let text = query.parameters().get(name);
        let number = text.map(|text| text.parse::<u32>().map_err(|_| format!("{name}={text} is no number")));
        number.transpose()
    };
    match (number("layout")?, number("tick")?) {
        (Some(layout), Some(tick)) => Ok(Some(Place { layout, tick })),
        (None, None) => Ok(None),
        _ => Err("a row is named by its layout and its tick: signals?layout=1;tick=1000".to_owned()),
    }
}

/// Gives answers as they come.
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
            Err(_) => refuse(&query, "no line to the device"),
        }
    }
}

fn refuse(query: &Query, reason: &str) {
    let reply = query.reply_err(json!({ "refused": reason }).to_string());
    let _ = reply.encoding(Encoding::APPLICATION_JSON).wait();
}
