//! Passes a request to the tick and returns its response.

use dimsart_link::protocol::{Request, Response};

use crate::handover::{QueueReceiver, QueueSender};

/// The tick's response.
pub(crate) type Answer = Response<'static>;

/// The queues to and from the tick.
pub(crate) struct TickHandover {
    pub(crate) requests: QueueSender<(u16, Request)>,
    pub(crate) answers: QueueReceiver<Answer>,
    /// Id of the current request.
    pub(crate) id: u16,
}

impl TickHandover {
    pub(crate) async fn ask(&mut self, request: Request) -> Answer {
        self.requests.send((self.id, request));
        self.answers.receive().await
    }
}
