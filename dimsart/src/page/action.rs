//! What a browser, or whoever commands over Zenoh, asks of a controller.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::page_device::{Hand, PageDevice};
use crate::connect::{ANY_SIDE, ConnectError, FindingText, Presence};
use hil_sim::schemes::SchemeText;

/// Something to be done, or to be looked at.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum Action {
    /// A change at once, as `dimsart connect PORT set`.
    Edit(Edit),
    /// Changes that take effect together, or, only tried, not at all: what the check says of them.
    Transaction {
        edits: Vec<Edit>,
        commit: bool,
    },
    /// Rows of a scheme as one transaction, upon what is there or in its place.
    Scheme {
        rows: String,
        #[serde(default)]
        replace: bool,
    },
    /// Takes the lease and holds it, as long as the client says that it is there.
    Arm,
    /// Says so, and whether it still holds it.
    Renew,
    /// Gives it back.
    Disarm,
    /// Drops the change of many commands that is open.
    Abort,
    Reset,
    Check,
    Events,
    Recorder {
        name: String,
    },
    Save,
    Confirm,
    RollBack,
    /// The scheme as rows.
    Rows,
    /// Begins a recording of every row of signals, or ends it.
    Record {
        on: bool,
    },
    /// Has the device send these signals to all who look; all, or the first ones that it can send, when none is named.
    Stream {
        names: Vec<String>,
    },
    /// Holds a reference of a simulated device by hand, or lets it go.
    Hold {
        signal: String,
        axis: usize,
        /// A number as text: as an edit's value, and because serde reads no fractions in tagged enums.
        value: Option<String>,
    },
}

/// A change of the scheme.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "edit", rename_all = "snake_case")]
pub(crate) enum Edit {
    Set { module: String, parameter: String, value: String },
    On { module: String, before: Option<String> },
    Off { module: String },
}

/// What the check says of changes that were only tried.
#[derive(Debug, Serialize)]
struct Tried {
    faults: u32,
    findings: Vec<FindingText>,
}

impl Action {
    /// Does it.
    pub(super) fn run(
        self,
        device: &mut PageDevice,
        hand: Option<&Hand>,
        presence: &Presence,
    ) -> Result<Value, ConnectError> {
        Ok(match self {
            Self::Edit(edit) => text(edit.run(device)?),
            Self::Transaction { edits, commit } => transaction(device, edits, commit, presence)?,
            Self::Scheme { rows, replace } => {
                let scheme = SchemeText { name: "rows".to_owned(), text: rows };
                json(&match replace {
                    true => device.replace_scheme(&scheme, ANY_SIDE)?,
                    false => device.send_scheme(&scheme, ANY_SIDE)?,
                })
            }
            Self::Arm => {
                device.hold_lease_for(presence)?;
                text("the lease is held as long as it is renewed")
            }
            Self::Renew => {
                device.renew_in_time()?;
                text("the lease is renewed")
            }
            Self::Disarm => {
                device.give_lease_back()?;
                text("the lease is given back: the device is at rest")
            }
            Self::Abort => text(device.abort()?),
            Self::Reset => text(device.reset(None)?),
            Self::Check => json(&device.check()?),
            Self::Events => json(&device.events()?),
            Self::Recorder { name } => json(&device.recorded(Some(&name))?),
            Self::Save => text(device.save()?),
            Self::Confirm => text(device.confirm()?),
            Self::RollBack => text(device.roll_back()?),
            Self::Rows => text(device.scheme_rows(None)?),
            Self::Hold { signal, axis, value } => {
                let no_hand =
                    || ConnectError::Word("a reference is held by hand in a simulation alone".to_owned());
                let no_number = |_| ConnectError::Word("a reference is held at a number".to_owned());
                let value = value.map(|value| value.parse().map_err(no_number)).transpose()?;
                hand.ok_or_else(no_hand)?(signal, axis, value).map_err(ConnectError::Word)?;
                Value::Null
            }
            // The station has threads for them.
            Self::Record { .. } | Self::Stream { .. } => Value::Null,
        })
    }
}

impl Action {
    /// Whether it is for the one that moves the device, while there is one.
    pub(super) fn changes(&self) -> bool {
        let lets_go = matches!(self, Self::Hold { value: None, .. });
        !lets_go && !matches!(self, Self::Events | Self::Recorder { .. } | Self::Rows)
    }

    /// Whether the device may begin to move by it.
    pub(super) fn moves(&self) -> bool {
        matches!(self, Self::Arm | Self::Reset | Self::Check)
    }
}

impl Edit {
    fn run(self, device: &mut PageDevice) -> Result<String, ConnectError> {
        let outcome = match self {
            Self::Set { module, parameter, value } => device.set(&module, &parameter, &value)?,
            Self::On { module, before } => device.on(&module, before.as_deref())?,
            Self::Off { module } => device.off(&module)?,
        };
        Ok(outcome.to_string())
    }
}

fn transaction(
    device: &mut PageDevice,
    edits: Vec<Edit>,
    commit: bool,
    presence: &Presence,
) -> Result<Value, ConnectError> {
    device.begin()?;
    let done = edits.into_iter().try_for_each(|edit| match presence.has_left() {
        true => Err(ConnectError::NobodyThere),
        false => edit.run(device).map(drop),
    });
    let done = done.and_then(|()| match commit {
        true => device.commit().map(text),
        false => {
            let check = device.check()?;
            Ok(json(&Tried { faults: check.faults, findings: check.findings }))
        }
    });
    if !commit || done.is_err() {
        // Of two errors the first one says more.
        let aborted = device.abort();
        if done.is_ok() {
            aborted?;
        }
    }
    done
}

fn text(text: impl ToString) -> Value {
    Value::String(text.to_string())
}

fn json(value: &impl Serialize) -> Value {
    // The reports are made of what JSON has.
    serde_json::to_value(value).unwrap_or_default()
}
