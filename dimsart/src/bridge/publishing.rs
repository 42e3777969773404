//! Publishes the news of a station.

use std::sync::Arc;
use std::time::SystemTime;

use serde::Deserialize;
use serde_json::Value;
use tokio::sync::broadcast::error::RecvError;
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use super::messages::{DIAGNOSTIC_ARRAY, JOINT_STATE, diagnostics, joint_state};
use super::ros::{Node, Topic};
use super::{BridgeError, Member, lock};
use crate::page::news::{News, Rows};

/// Publishes a station's news.
pub(super) struct Publishing {
    session: Session,
    member: Arc<Member>,
    joint_states: Topic,
    diagnostics: Topic,
}

/// A piece of news of a station.
#[derive(Debug, Deserialize)]
pub(super) struct Told {
    kind: String,
    pub(super) content: Value,
}

impl Told {
    /// Parses it; none if it is for the page only.
    pub(super) fn read(text: &str) -> Option<Self> {
        let told: Self = serde_json::from_str(text).ok()?;
        (told.kind != "kinds").then_some(told)
    }

    /// Last part of its key.
    pub(super) fn key(&self) -> &str {
        if self.kind == "status" { "state" } else { &self.kind }
    }
}

impl Publishing {
    pub(super) fn new(session: &Session, node: &Node, member: &Arc<Member>) -> Result<Self, BridgeError> {
        let joint_states = node.topic(session, &format!("{}/joint_states", member.key), JOINT_STATE)?;
        let diagnostics = node.topic(session, "diagnostics", DIAGNOSTIC_ARRAY)?;
        Ok(Self { session: session.clone(), member: Arc::clone(member), joint_states, diagnostics })
    }

    /// Runs until the station ends.
    pub(super) fn run(mut self) {
        let (last, mut news) = self.member.station.board().read();
        last.iter().for_each(|text| self.text(text));
        let mut missed = 0;
        loop {
            match news.blocking_recv() {
                Ok(News::Text(text)) => self.text(&text),
                Ok(News::Rows(rows)) => self.rows(&rows),
                Ok(News::Discontinuity(_)) => {}
                Err(RecvError::Lagged(more)) => {
                    missed += more;
                    self.put("missed", missed.to_string(), Encoding::APPLICATION_JSON);
                }
                Err(RecvError::Closed) => return,
            }
        }
    }

    fn text(&mut self, text: &str) {
        let Some(told) = Told::read(text) else { return };
        self.put(told.key(), told.content.to_string(), Encoding::APPLICATION_JSON);
        let faults = match (told.kind.as_str(), &told.content) {
            ("faults", faults) => Ok(faults),
            ("gone", Value::String(reason)) => Err(reason.as_str()),
            _ => return,
        };
        let now = SystemTime::now();
        if let Some(message) = diagnostics(&self.member.key, faults, now) {
            self.diagnostics.put(message, now);
        }
    }

    fn rows(&mut self, rows: &Rows) {
        // Keep the rows before a put that may block.
        let Some(message) = lock(&self.member.kept).add(rows) else { return };
        self.put("signals", message, Encoding::APPLICATION_OCTET_STREAM);
        let now = SystemTime::now();
        let state =
            rows.rows.last().and_then(|row| joint_state(self.member.station.name(), &rows.signals, row, now));
        if let Some(message) = state {
            self.joint_states.put(message, now);
        }
    }

    /// Publishes a payload; blocks on a slow router rather than dropping it.
    fn put(&self, key: &str, payload: impl Into<ZBytes>, encoding: Encoding) {
        let key = format!("{}/{key}", self.member.key);
        let put = self.session.put(key, payload).encoding(encoding);
        // Fails only if the session is closed, at the end of the bridge.
        let _ = put.congestion_control(CongestionControl::Block).wait();
    }
}
