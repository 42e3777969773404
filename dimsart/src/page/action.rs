//! Actions on a controller, requested by a browser or over Zenoh.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::page_device::{PageDevice, ReferenceOverrideFn};
use crate::connect::{ALL_DESTINATIONS, ConnectError, FindingReport, Overview, Presence};
use hil_sim::response::Held;
use hil_sim::schemes::SchemeText;

/// A requested action.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum Action {
    /// Applies one change immediately, as `dimsart connect PORT set`.
    Edit(Edit),
    /// Applies changes together, or only checks them; `rows` replace the scheme before the changes.
    Transaction {
        #[serde(default)]
        rows: Option<String>,
        edits: Vec<Edit>,
        commit: bool,
    },
    /// Sends rows of a scheme in one transaction; they add to the scheme or replace it.
    Scheme {
        rows: String,
        #[serde(default)]
        replace: bool,
    },
    /// Takes the lease and holds it while the client reports its presence.
    Arm,
    /// Reports presence, and checks that the client still holds the lease.
    Renew,
    /// Releases the lease.
    Disarm,
    /// Aborts the open transaction.
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
    /// Reads the scheme as rows.
    Rows,
    /// Starts or ends a recording of all signal rows.
    Record {
        on: bool,
    },
    /// Selects the signals that the device sends to all pages; if empty, all signals, or as many as it can send.
    Stream {
        names: Vec<String>,
    },
    /// Holds a reference of a simulated device, or releases it.
    Hold {
        signal: String,
        axis: usize,
        /// A number as text: as an edit's value, and because serde reads no fractions in tagged enums.
        value: Option<String>,
        /// Whether it moves there at limited speed.
        #[serde(default)]
        ramp: bool,
    },
    /// Excites a reference of a simulated device for a limited time, then releases it.
    Excite {
        signal: String,
        axis: usize,
        /// An [`Excitation`](hil_sim::response::Excitation) as text.
        excitation: String,
    },
}

/// A change of the scheme.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "edit", rename_all = "snake_case")]
pub(crate) enum Edit {
    Set { module: String, parameter: String, value: String },
    On { module: String, before: Option<String> },
    Off { module: String },
    Close { module: String },
}

/// The pending scheme after a check of changes that are not applied.
#[derive(Debug, Serialize)]
struct Tried {
    /// Reason why a change was refused; later changes were not tried.
    refused: Option<String>,
    faults: u32,
    findings: Vec<FindingReport>,
    overview: Overview,
}

impl Action {
    /// Carries the action out.
    pub(super) fn run(
        self,
        device: &mut PageDevice,
        hand: Option<&ReferenceOverrideFn>,
        presence: &Presence,
    ) -> Result<Value, ConnectError> {
        Ok(match self {
            Self::Edit(edit) => text(edit.run(device)?),
            Self::Transaction { rows, edits, commit } => transaction(device, rows, edits, commit, presence)?,
            Self::Scheme { rows, replace } => {
                let scheme = scheme_text(rows);
                json(&match replace {
                    true => device.replace_scheme(&scheme, ALL_DESTINATIONS)?,
                    false => device.send_scheme(&scheme, ALL_DESTINATIONS)?,
                })
            }
            Self::Arm => {
                device.hold_lease_while_present(presence)?;
                text("armed: the lease lasts while the client sends renewals")
            }
            Self::Renew => {
                device.renew_if_due()?;
                text("lease renewed")
            }
            Self::Disarm => {
                device.release_lease()?;
                text("disarmed: lease released, outputs at their safe value")
            }
            Self::Abort => text(device.abort()?),
            Self::Reset => text(device.reset(None)?),
            Self::Check => json(&device.check()?),
            Self::Events => json(&device.events()?),
            Self::Recorder { name } => json(&device.read_recorder(Some(&name))?),
            Self::Save => text(device.save()?),
            Self::Confirm => text(device.confirm()?),
            Self::RollBack => text(device.roll_back()?),
            Self::Rows => text(device.scheme_rows(None)?),
            Self::Hold { signal, axis, value, ramp } => {
                let no_number = |_| ConnectError::InvalidWord("invalid reference: not a number".to_owned());
                let held = match value {
                    Some(value) if ramp => Held::GoTo(value.parse().map_err(no_number)?),
                    Some(value) => Held::At(value.parse().map_err(no_number)?),
                    None => Held::Released,
                };
                hold(hand, signal, axis, held)?
            }
            Self::Excite { signal, axis, excitation } => {
                let excitation = excitation.parse().map_err(ConnectError::InvalidWord)?;
                hold(hand, signal, axis, Held::Excited(excitation))?
            }
            // Handled by threads of the station.
            Self::Record { .. } | Self::Stream { .. } => Value::Null,
        })
    }
}

impl Action {
    /// Returns the reference that the action holds or releases: signal, axis, and whether it is held.
    pub(super) fn held(&self) -> Option<(&str, usize, bool)> {
        match self {
            Self::Hold { signal, axis, value, .. } => Some((signal, *axis, value.is_some())),
            Self::Excite { signal, axis, .. } => Some((signal, *axis, true)),
            _ => None,
        }
    }

    /// Returns whether the action releases a reference.
    pub(super) fn releases(&self) -> bool {
        matches!(self, Self::Hold { value: None, .. })
    }

    /// Returns whether the action is reserved for the holder of the lease.
    pub(super) fn changes(&self) -> bool {
        !self.releases() && !matches!(self, Self::Events | Self::Recorder { .. } | Self::Rows)
    }

    /// Returns whether the action may start motion.
    pub(super) fn moves(&self) -> bool {
        matches!(self, Self::Arm | Self::Reset | Self::Check)
    }
}

impl Edit {
    fn run(self, device: &mut PageDevice) -> Result<String, ConnectError> {
        let outcome = match self {
            Self::Set { module, parameter, value } => device.set(&module, &parameter, &value)?,
            Self::On { module, before } => device.plug_in(&module, before.as_deref())?,
            Self::Off { module } => device.unplug(&module)?,
            Self::Close { module } => device.delete_module(Some(&module))?,
        };
        Ok(outcome.to_string())
    }
}

/// Holds, excites or releases a reference of a simulated device.
fn hold(
    hand: Option<&ReferenceOverrideFn>,
    signal: String,
    axis: usize,
    held: Held,
) -> Result<Value, ConnectError> {
    let no_hand = || ConnectError::InvalidWord("a reference can be held only in a simulation".to_owned());
    hand.ok_or_else(no_hand)?(signal, axis, held).map_err(ConnectError::InvalidWord)?;
    Ok(Value::Null)
}

fn transaction(
    device: &mut PageDevice,
    rows: Option<String>,
    edits: Vec<Edit>,
    commit: bool,
    presence: &Presence,
) -> Result<Value, ConnectError> {
    device.begin()?;
    let replaced = rows.map_or(Ok(()), |rows| device.replace_pending(&scheme_text(rows)));
    let done = replaced.and_then(|()| {
        edits.into_iter().try_for_each(|edit| match presence.has_left() {
            true => Err(ConnectError::ClientSilent),
            false => edit.run(device).map(drop),
        })
    });
    let done = match commit {
        true => done.and_then(|()| device.commit().map(text)),
        false => tried(device, done).map(|tried| json(&tried)),
    };
    if !commit || done.is_err() {
        // An earlier error takes precedence.
        let aborted = device.abort();
        if done.is_ok() {
            aborted?;
        }
    }
    done
}

fn scheme_text(rows: String) -> SchemeText {
    SchemeText { name: "rows".to_owned(), text: rows }
}

/// Reads and checks the pending scheme.
fn tried(device: &mut PageDevice, done: Result<(), ConnectError>) -> Result<Tried, ConnectError> {
    let refused = match done {
        Err(error @ (ConnectError::Line(_) | ConnectError::ClientSilent)) => return Err(error),
        done => done.err().map(|error| error.to_string()),
    };
    let check = device.check()?;
    Ok(Tried { refused, faults: check.faults, findings: check.findings, overview: device.overview()? })
}

fn text(text: impl ToString) -> Value {
    Value::String(text.to_string())
}

fn json(value: &impl Serialize) -> Value {
    // Reports are always representable in JSON.
    serde_json::to_value(value).unwrap_or_default()
}
