//! Publishes controllers over Zenoh and accepts commands from there, for fleets and ROS 2.
//!
//! ```text
//! Station ──news──▶ Publishing ──put──▶ router ──▶ subscribers, such as ROS 2
//! Station ◀─asks─── Taking ◀───query─── router ◀── commands, under the lease
//! ```
//! A station is a client of the broker, as for the page. The bridge does not delay ticks; a lost router does not affect other
//! clients. Keys and forms: `docs/howto/fleet-over-zenoh.md`.

mod messages;
mod publishing;
mod ros;
mod rows;
mod taking;

use std::fmt::Display;
use std::io;
use std::sync::{Arc, Mutex};
use std::thread;

use zenoh::{Config, Session, Wait};

use crate::page::Station;
use publishing::Publishing;
use ros::Node;
use rows::Kept;
use taking::Taking;

/// Error of [`Bridge::open`].
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// No router at this address.
    #[error(
        "no Zenoh router at {router}: {reason}; start a router (`zenohd`, in ROS 2 `ros2 run rmw_zenoh_cpp \
         rmw_zenohd`), or give the router's address with --router, such as tcp/localhost:7447"
    )]
    NoRouter {
        /// Address of the router.
        router: String,
        /// Error of Zenoh.
        reason: String,
    },
    /// A name that is invalid in keys.
    #[error(
        "invalid station name or key prefix '{0}': use letters, digits, '_' and '-', starting with a letter"
    )]
    Name(String),
    /// Two stations with the same name.
    #[error("duplicate station name {0}: give each port its own name, `NAME=PORT`")]
    DuplicateName(String),
    /// Another error of Zenoh.
    #[error("Zenoh error: {0}")]
    Zenoh(String),
    /// A thread cannot be started.
    #[error("cannot start a thread for a station: {0}")]
    Thread(#[from] io::Error),
}

/// Address and keys of published stations.
#[derive(Debug, Clone)]
pub struct BridgeAddress {
    /// The router, such as `tcp/localhost:7447`.
    pub router: String,
    /// First part of every key.
    pub prefix: String,
    /// `ROS_DOMAIN_ID` of `JointState` and diagnostics.
    pub ros_domain: u32,
}

/// A connection to a router. Stations are published there until it is dropped.
#[derive(Debug)]
pub struct Bridge {
    session: Session,
    stations: Vec<Arc<Member>>,
    _node: Node,
}

/// A station on the bridge.
#[derive(Debug)]
struct Member {
    /// First parts of its keys.
    key: String,
    station: Station,
    kept: Mutex<Kept>,
    /// The last client that took the lease.
    mover: Mutex<Option<u64>>,
}

impl Bridge {
    /// Publishes stations and takes commands for them.
    ///
    /// # Errors
    /// [`BridgeError`].
    pub fn open(place: &BridgeAddress, stations: Vec<Station>) -> Result<Self, BridgeError> {
        let names = || stations.iter().map(Station::name);
        for name in names().chain([place.prefix.as_str()]) {
            check_name(name)?;
        }
        if let Some(name) = names().find(|name| names().filter(|other| other == name).count() > 1) {
            return Err(BridgeError::DuplicateName(name.to_owned()));
        }
        let session = open(&place.router)?;
        let node = Node::declare(&session, place)?;
        let mut members = Vec::new();
        for station in stations {
            let key = format!("{}/{}", place.prefix, station.name());
            let member = Arc::new(Member { key, station, kept: Mutex::default(), mover: Mutex::default() });
            let publishing = Publishing::new(&session, &node, &member)?;
            let taking = Taking::new(&session, &member)?;
            let thread = thread::Builder::new().name(format!("{} publishing", member.key));
            thread.spawn(move || publishing.run())?;
            taking.start()?;
            members.push(member);
        }
        Ok(Self { session, stations: members, _node: node })
    }

    /// Whether the router is connected.
    #[must_use]
    pub fn is_router_connected(&self) -> bool {
        self.session.info().routers_zid().wait().next().is_some()
    }

    /// Releases the leases of clients of the router, which can no longer renew them or stop.
    pub fn release_leases(&self) {
        self.stations.iter().for_each(|member| member.release_leases());
    }

    /// Returns the keys of the stations, in order.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.stations.iter().map(|member| member.key.as_str())
    }
}

impl Member {
    fn release_leases(&self) {
        if let Some(mover) = lock(&self.mover).take() {
            self.station.hear(mover, false);
        }
    }
}

/// Opens a client of one router: without listening or scouting, and with automatic reconnection.
fn open(router: &str) -> Result<Session, BridgeError> {
    let mut config = Config::default();
    for (key, value) in [
        ("mode", r#""client""#),
        ("connect/retry", r#"{"period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 2}"#),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
    ] {
        config.insert_json5(key, value).map_err(failed)?;
    }
    let no_router = |reason: String| BridgeError::NoRouter { router: router.to_owned(), reason };
    // Zenoh reports an invalid address with an error of its parser.
    let no_place = |_| no_router("invalid address, expected tcp/HOST:PORT".to_owned());
    config.insert_json5("connect/endpoints", &serde_json::json!([router]).to_string()).map_err(no_place)?;
    zenoh::open(config).wait().map_err(|error| no_router(error.to_string()))
}

fn check_name(name: &str) -> Result<(), BridgeError> {
    let is_well = name.starts_with(|first: char| first.is_ascii_alphabetic())
        && name.chars().all(|letter| letter.is_ascii_alphanumeric() || matches!(letter, '_' | '-'));
    if is_well { Ok(()) } else { Err(BridgeError::Name(name.to_owned())) }
}

fn failed(error: impl Display) -> BridgeError {
    BridgeError::Zenoh(error.to_string())
}

/// Locks a mutex, also if a thread panicked with it: the content stays valid.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
