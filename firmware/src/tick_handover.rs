//! The way of a request to the tick and of its answer back.

use dimsart_link::protocol::{Request, Response};

use crate::handover::{Giver, Taker};

/// What the tick makes of a request.
pub(crate) type Answer = Response<'static>;

/// The way to the tick and back.
pub(crate) struct TickHandover {
    pub(crate) requests: Giver<(u16, Request)>,
    pub(crate) answers: Taker<Answer>,
    /// Of the request that is being carried out.
    pub(crate) id: u16,
}

impl TickHandover {
    pub(crate) async fn ask(&mut self, request: Request) -> Answer {
        self.requests.give((self.id, request));
        self.answers.next().await
    }
}
