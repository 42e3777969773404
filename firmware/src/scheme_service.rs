//! Scheme service: stores schemes, outside the tick.

use boards::Selected;
use dimsart_core::{CommandCursor, CommandError};
use dimsart_link::protocol::{
    LeaseAction, Origin, Refusal, Request, Response, SchemeAction, SchemeStatus, StoreError, Trial,
};
use dimsart_link::saved_scheme::Writer;
use firmware::{SchemeStore, StorageError};
use heapless::vec::VecView;

use crate::command_line::CommandLine;
use crate::tick_handover::{Answer, TickHandover};

pub(crate) type Store = SchemeStore<<Selected as boards::Board>::Flash>;

/// The stored schemes, and the result of the last start.
pub(crate) struct SchemeService {
    /// `None` on a board without storage.
    pub(crate) store: Option<Store>,
    /// Whether a flash write stalls the tick.
    pub(crate) stalls_tick: bool,
    pub(crate) status: SchemeStatus,
    pub(crate) fingerprint: u32,
    /// Buffer for a scheme.
    pub(crate) scheme: &'static mut VecView<u8>,
}

impl SchemeService {
    /// Handles a client's request. Reports of the tick continue, except while flash is written.
    pub(crate) async fn carry_out(
        &mut self,
        action: SchemeAction,
        tick: &mut TickHandover,
        line: &mut CommandLine,
    ) -> Answer {
        match self.try_to(action, tick, line).await {
            Ok(()) => Response::Schemes(self.status),
            Err(refusal) => Response::Refused(refusal),
        }
    }

    async fn try_to(
        &mut self,
        action: SchemeAction,
        tick: &mut TickHandover,
        line: &mut CommandLine,
    ) -> Result<(), Refusal> {
        let Some(store) = &mut self.store else {
            return if action == SchemeAction::Read { Ok(()) } else { Err(refused(StoreError::NoStorage)) };
        };
        if self.stalls_tick && action != SchemeAction::Read && runs(tick).await {
            return Err(refused(StoreError::SchemeIsRunning));
        }
        let is_tried = self.status.origin == Origin::Trial;
        let result = match action {
            SchemeAction::Save => {
                collect(self.scheme, self.fingerprint, tick, line).await?;
                // Renews the lease of the saving client: the board receives nothing during the write.
                tick.ask(Request::Lease(LeaseAction::Renew)).await;
                store.save(self.scheme).await
            }
            SchemeAction::Confirm if is_tried && store.trial() == Trial::Tried => store.confirm().await,
            // Already confirmed; the response was lost.
            SchemeAction::Confirm if is_tried && store.trial() == Trial::None && store.is_saved() => Ok(()),
            SchemeAction::Confirm => return Err(refused(StoreError::NoTrial)),
            SchemeAction::RollBack => store.roll_back().await,
            SchemeAction::Read => Ok(()),
            _ => return Err(Refusal::Unsupported),
        };
        (self.status.trial, self.status.is_saved) = (store.trial(), store.is_saved());
        result.map_err(|StorageError| refused(StoreError::Storage))
    }
}

fn refused(error: StoreError) -> Refusal {
    Refusal::Store(error)
}

pub(crate) async fn runs(tick: &mut TickHandover) -> bool {
    matches!(tick.ask(Request::Status).await, Response::Status(status) if status.is_running)
}

/// Collects the scheme, one command per tick. It cannot change meanwhile, because changes wait for this task.
async fn collect(
    scheme: &mut VecView<u8>,
    fingerprint: u32,
    tick: &mut TickHandover,
    line: &mut CommandLine,
) -> Result<(), Refusal> {
    // An open transaction would not match the saved scheme.
    if matches!(tick.ask(Request::Status).await, Response::Status(status) if status.is_in_transaction) {
        return Err(Refusal::Engine(CommandError::TransactionOpen));
    }
    if let Response::Finding { faults: faults @ 1.., .. } = tick.ask(Request::Finding { index: 0 }).await {
        let faults = usize::try_from(faults).unwrap_or(usize::MAX);
        return Err(Refusal::Engine(CommandError::HasFaults { faults }));
    }
    let too_long = |_| refused(StoreError::TooLong);
    let (mut writer, mut cursor) = (Writer::new(scheme, fingerprint), CommandCursor::default());
    loop {
        line.say_report().await;
        let (place, index) = cursor.next_command_location();
        let answer = tick.ask(Request::SchemeCommand { place, index }).await;
        let is_there = if let Response::SchemeCommand(command) = answer {
            writer.push(&command).map_err(too_long)?;
            true
        } else {
            false
        };
        if !cursor.advance(is_there) {
            return writer.finish().map_err(too_long);
        }
    }
}
