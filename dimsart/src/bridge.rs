//! Stations over Zenoh: a fleet on the engine that many robots share already.
//!
//! ```text
//! Station ──news──▶ Publishing ──put──▶ router ──▶ whoever listens, ROS 2 among them
//! Station ◀─asks─── Taking ◀───query─── router ◀── whoever commands, under the lease
//! ```
//! A station here is what the page has, too: a client of the broker. Nothing here is in the way of a tick, and a router
//! that is gone takes nothing from who records beside it. Keys and forms: `docs/commands.md`.

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

/// Why there is no bridge.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// The router is not there, or is none.
    #[error(
        "no Zenoh router at {router}: {reason}; start one (`zenohd`, in ROS 2 `ros2 run rmw_zenoh_cpp rmw_zenohd`), or \
         say with --router where it is, such as tcp/localhost:7447"
    )]
    NoRouter {
        /// Where it should be.
        router: String,
        /// What Zenoh says.
        reason: String,
    },
    /// A name that stands in keys.
    #[error("'{0}' does not go into a key: names are letters, digits, '_' and '-', and begin with a letter")]
    Name(String),
    /// Two stations that would be one.
    #[error("two stations are called {0}: give them names, `NAME=PORT`")]
    Twice(String),
    /// Anything else that Zenoh says.
    #[error("Zenoh: {0}")]
    Zenoh(String),
    /// No thread.
    #[error("no thread for a station: {0}")]
    Thread(#[from] io::Error),
}

/// Where stations are published.
#[derive(Debug, Clone)]
pub struct Place {
    /// The router, such as `tcp/localhost:7447`.
    pub router: String,
    /// First part of every key.
    pub prefix: String,
    /// `ROS_DOMAIN_ID` of who reads `JointState` and diagnostics.
    pub ros_domain: u32,
}

/// A router, and the stations that are published there until this goes.
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
    /// The client that took the lease last.
    mover: Mutex<Option<u64>>,
}

impl Bridge {
    /// Publishes stations and takes commands for them.
    ///
    /// # Errors
    /// [`BridgeError`].
    pub fn open(place: &Place, stations: Vec<Station>) -> Result<Self, BridgeError> {
        let names = || stations.iter().map(Station::name);
        for name in names().chain([place.prefix.as_str()]) {
            check_name(name)?;
        }
        if let Some(name) = names().find(|name| names().filter(|other| other == name).count() > 1) {
            return Err(BridgeError::Twice(name.to_owned()));
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

    /// Whether the router is there.
    #[must_use]
    pub fn has_router(&self) -> bool {
        self.session.info().routers_zid().wait().next().is_some()
    }

    /// Ends what is moved from over the router: nobody there can renew it, or stop it, any more.
    pub fn let_go(&self) {
        self.stations.iter().for_each(|member| member.let_go());
    }

    /// The keys of the stations, in their order.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.stations.iter().map(|member| member.key.as_str())
    }
}

impl Member {
    fn let_go(&self) {
        if let Some(mover) = lock(&self.mover).take() {
            self.station.hear(mover, false);
        }
    }
}

/// A client of one router: it listens nowhere, looks for nobody, and comes back when the router does.
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
    // Zenoh's own words for a wrong place are those of its parser.
    let no_place = |_| no_router("that is no place such as tcp/HOST:PORT".to_owned());
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

/// What a thread that panicked has left is as good as it was.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
