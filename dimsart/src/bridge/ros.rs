//! Keys, liveliness tokens and attachments of `rmw_zenoh_cpp` (ROS 2), from its `docs/design.md` and source. Not tested with
//! ROS 2.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use xxhash_rust::xxh3::xxh3_128;
use zenoh::bytes::Encoding;
use zenoh::liveliness::LivelinessToken;
use zenoh::{Session, Wait};

use super::messages::MessageType;
use super::{BridgeAddress, BridgeError, failed};

/// Reliable, volatile, depth 10; the others are defaults of ROS 2.
const QUALITY: &str = "::,10:,:,:,,";

/// The bridge as a node of ROS 2.
#[derive(Debug)]
pub(super) struct Node {
    domain: u32,
    session_id: String,
    name: String,
    /// Number of the next publisher; the node itself is 0.
    next: AtomicU32,
    _token: LivelinessToken,
}

/// A topic that the bridge publishes to.
#[derive(Debug)]
pub(super) struct Topic {
    session: Session,
    key: String,
    /// Identifier of the publisher in ROS 2.
    gid: [u8; 16],
    sequence: i64,
    _token: LivelinessToken,
}

impl Node {
    pub(super) fn declare(session: &Session, place: &BridgeAddress) -> Result<Self, BridgeError> {
        let (domain, session_id) = (place.ros_domain, session.zid().to_string());
        let name = format!("{}_bridge", ros_name(&place.prefix));
        let key = format!("@ros2_lv/{domain}/{session_id}/0/0/NN/%/%/{name}");
        let token = session.liveliness().declare_token(key).wait().map_err(failed)?;
        Ok(Self { domain, session_id, name, next: AtomicU32::new(1), _token: token })
    }

    /// Declares a topic, such as `dimsart/joint/joint_states`.
    pub(super) fn topic(
        &self,
        session: &Session,
        topic: &str,
        message: MessageType,
    ) -> Result<Topic, BridgeError> {
        let Self { domain, session_id, name, .. } = self;
        let (topic, MessageType { name: kind, hash }) = (ros_name(topic), message);
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let mangled = topic.replace('/', "%");
        let token = format!(
            "@ros2_lv/{domain}/{session_id}/0/{number}/MP/%/%/{name}/%{mangled}/{kind}/{hash}/{QUALITY}"
        );
        let gid = xxh3_128(token.as_bytes()).to_le_bytes();
        let token = session.liveliness().declare_token(token).wait().map_err(failed)?;
        let key = format!("{domain}/{topic}/{kind}/{hash}");
        Ok(Topic { session: session.clone(), key, gid, sequence: 0, _token: token })
    }
}

impl Topic {
    /// Publishes a message in CDR; lost without a subscriber.
    pub(super) fn put(&mut self, message: Vec<u8>, now: SystemTime) {
        self.sequence += 1;
        let attachment = attachment(self.sequence, now, self.gid);
        // Fails only if the session is closed, at the end of the bridge.
        let _ = self
            .session
            .put(&self.key, message)
            .encoding(Encoding::APPLICATION_CDR)
            .attachment(attachment)
            .wait();
    }
}

/// Sequence number, time in ns, length of the publisher's identifier and the identifier, little endian.
fn attachment(sequence: i64, now: SystemTime, gid: [u8; 16]) -> Vec<u8> {
    let since = now.duration_since(UNIX_EPOCH).unwrap_or_default();
    let time_ns = i64::try_from(since.as_nanos()).unwrap_or(i64::MAX);
    let mut bytes = [sequence, time_ns].map(i64::to_le_bytes).concat();
    bytes.push(16);
    bytes.extend(gid);
    bytes
}

/// Replaces hyphens, which are invalid in ROS 2 names.
fn ros_name(name: &str) -> String {
    name.replace('-', "_")
}
