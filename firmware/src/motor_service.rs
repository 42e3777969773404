//! Motor service: stores the motor configuration, outside the tick.

use boards::{Board, Joints, Selected};
use dimsart_link::protocol::{
    MAX_MOTOR_WORDS, MotorAction, MotorRefusal, MotorReport, Refusal, Request, Response, StoreError,
    motor_checksum,
};
use firmware::StorageError;

use crate::scheme_service::{SchemeService, runs};
use crate::tick_handover::{Answer, TickHandover};

type Motor = <Selected as Board>::Joints;

/// The active configuration, and the words received so far.
pub(crate) struct MotorService {
    pub(crate) report: MotorReport,
    pub(crate) put: [u32; MAX_MOTOR_WORDS],
}

impl MotorService {
    /// Handles a client's request. The tick only checks the permission.
    pub(crate) async fn carry_out(
        &mut self,
        action: MotorAction,
        schemes: &mut SchemeService,
        tick: &mut TickHandover,
    ) -> Answer {
        match tick.ask(Request::Motor(action)).await {
            Response::Refused(Refusal::NotFound) if Motor::HAS_DRIVE => {}
            refused => return refused,
        }
        let done = match action {
            MotorAction::PutWord { place, word } => {
                if let Some(put) = self.put.get_mut(usize::from(place)) {
                    *put = word;
                }
                Ok(())
            }
            MotorAction::Store { layout, count, checksum } => {
                let words = self.put.get(..usize::from(count)).unwrap_or_default();
                if motor_checksum(words) == checksum {
                    match Motor::check_motor(layout, words) {
                        Ok(()) => keep(layout, words, schemes, tick).await,
                        Err(fallback) => Err(Refusal::Motor(MotorRefusal::Invalid(fallback))),
                    }
                } else {
                    Err(Refusal::Motor(MotorRefusal::Incomplete))
                }
            }
            MotorAction::Delete => keep(0, &[], schemes, tick).await,
            MotorAction::Identify { current_a } => {
                Motor::identify(current_a);
                return Response::Identification(Motor::identification());
            }
            MotorAction::ReadIdentification => return Response::Identification(Motor::identification()),
            MotorAction::Read => Ok(()),
            _ => Err(Refusal::Unsupported),
        };
        match done {
            Ok(()) => {
                self.report.is_restart_pending |=
                    matches!(action, MotorAction::Store { .. } | MotorAction::Delete);
                Response::Motor(self.report.clone())
            }
            Err(refusal) => Response::Refused(refusal),
        }
    }
}

async fn keep(
    layout: u16,
    words: &[u32],
    schemes: &mut SchemeService,
    tick: &mut TickHandover,
) -> Result<(), Refusal> {
    let Some(store) = &mut schemes.store else { return Err(Refusal::Store(StoreError::NoStorage)) };
    if schemes.stalls_tick && runs(tick).await {
        return Err(Refusal::Store(StoreError::SchemeIsRunning));
    }
    let kept = store.store_motor(layout, words).await;
    (schemes.status.trial, schemes.status.is_saved) = (store.trial(), store.is_saved());
    kept.map_err(|StorageError| Refusal::Store(StoreError::Storage))
}
