//! Telemetry: signals that a device sends, distributed over streams.

use std::io::{Read, Write};

use dimsart_core::TypeRef;
use dimsart_link::protocol::{
    MAX_TELEMETRY_SIGNALS, MAX_TELEMETRY_WORDS, NO_CLIENT, Refusal, Request, Response, Sample, request_client,
};

use super::{ConnectError, Device};

/// Subscribed streams.
#[derive(Debug, Clone, Default)]
pub(super) struct Streams(Vec<Stream>);

#[derive(Debug, Clone)]
struct Stream {
    id: u16,
    /// Stream number on the device.
    number: usize,
    /// Index of its first word among all words.
    first: usize,
    words: usize,
    /// Counter of the last sample.
    counter: Option<u16>,
}

impl Streams {
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    fn numbers(&self) -> impl Iterator<Item = usize> {
        self.0.iter().map(|stream| stream.number)
    }

    /// Returns the index of a sample's first word among all words; `None` for an unknown stream or another scheme.
    ///
    /// Adds the samples that were lost before it to `lost`.
    pub(super) fn place(&mut self, sample: &Sample, lost: &mut u64) -> Option<usize> {
        let stream = self.0.iter_mut().find(|stream| stream.id == sample.id)?;
        if let Some(last) = stream.counter {
            *lost += u64::from(sample.counter.wrapping_sub(last).saturating_sub(1));
        }
        stream.counter = Some(sample.counter);
        (sample.words.len() == stream.words).then_some(stream.first)
    }
}

/// Removes the signals that would need the last stream.
pub(super) fn without_last_stream(signals: &mut Vec<(TypeRef, usize)>) {
    let words: Vec<usize> = signals.iter().map(|(_, words)| *words).collect();
    let last = parts(&words).and_then(|parts| parts.last()?.first().copied());
    signals.truncate(last.unwrap_or_default());
}

/// Distributes signals over streams: indices per stream, in order. `None` if a signal is too wide for a stream.
fn parts(words: &[usize]) -> Option<Vec<Vec<usize>>> {
    let mut parts: Vec<Vec<usize>> = Vec::new();
    let mut room = 0;
    for (number, words) in words.iter().copied().enumerate() {
        if words > MAX_TELEMETRY_WORDS {
            return None;
        }
        match parts.last_mut().filter(|part| part.len() < MAX_TELEMETRY_SIGNALS && words <= room) {
            Some(part) => part.push(number),
            None => {
                parts.push(vec![number]);
                room = MAX_TELEMETRY_WORDS;
            }
        }
        room -= words;
    }
    Some(parts)
}

impl<S: Read + Write> Device<S> {
    /// Subscribes to signals, given with their number of words. `None` if there are too many, or the device has no free
    /// stream.
    pub(super) fn subscribe(
        &mut self,
        signals: &[(TypeRef, usize)],
        every_ticks: u32,
    ) -> Result<Option<Streams>, ConnectError> {
        let words: Vec<usize> = signals.iter().map(|(_, words)| *words).collect();
        let Some(parts) = parts(&words).filter(|parts| !parts.is_empty()) else { return Ok(None) };
        let (mut streams, mut first, mut number) = (Streams::default(), 0, 0);
        for part in parts {
            let signals: Vec<TypeRef> =
                part.iter().filter_map(|place| signals.get(*place)).map(|(signal, _)| *signal).collect();
            loop {
                match self.open_stream(number, &signals, every_ticks)? {
                    Opened::Sent => break,
                    // The stream belongs to another client.
                    Opened::Taken => number += 1,
                    Opened::Refused => {
                        // The stream may be partly open.
                        let begun = streams.numbers().chain([number]).collect();
                        self.end_streams(begun, signals.first().copied())?;
                        return Ok(None);
                    }
                }
            }
            let words = part.iter().filter_map(|place| words.get(*place)).sum();
            streams.0.push(Stream { id: self.line().last_id(), number, first, words, counter: None });
            first += words;
            number += 1;
        }
        Ok(Some(streams))
    }

    fn open_stream(
        &mut self,
        number: usize,
        signals: &[TypeRef],
        every_ticks: u32,
    ) -> Result<Opened, ConnectError> {
        for (index, signal) in signals.iter().enumerate() {
            let Ok(place) = u8::try_from(number * MAX_TELEMETRY_SIGNALS + index) else {
                return Ok(Opened::Refused);
            };
            let request = Request::Telemetry { place, signal: *signal, every_ticks };
            match self.ask(&request, |response| matches!(response, Response::Telemetry { .. }).then_some(()))
            {
                Ok(Some(())) => {}
                Err(ConnectError::Refused(Refusal::Telemetry { client })) if client != NO_CLIENT => {
                    return Ok(Opened::Taken);
                }
                Ok(None) | Err(ConnectError::Refused(_)) => return Ok(Opened::Refused),
                Err(error) => return Err(error),
            }
        }
        Ok(Opened::Sent)
    }

    /// Ends the streams of this client; `signal` is any existing signal.
    pub(super) fn unsubscribe(&mut self, streams: &Streams, signal: TypeRef) -> Result<(), ConnectError> {
        debug_assert!(streams.0.iter().all(|stream| request_client(stream.id) == self.client()));
        self.end_streams(streams.numbers().collect(), Some(signal))
    }

    fn end_streams(&mut self, numbers: Vec<usize>, signal: Option<TypeRef>) -> Result<(), ConnectError> {
        let Some(signal) = signal else { return Ok(()) };
        for number in numbers {
            let Ok(place) = u8::try_from(number * MAX_TELEMETRY_SIGNALS) else { break };
            match self.ask(&Request::Telemetry { place, signal, every_ticks: 0 }, |_| Some(())) {
                Ok(_) | Err(ConnectError::Refused(_)) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

/// Result of opening a stream.
enum Opened {
    Sent,
    Taken,
    Refused,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_share_a_stream_as_long_as_there_is_room() {
        assert_eq!(parts(&[3, 3, 3, 3, 3]), Some(vec![vec![0, 1, 2, 3], vec![4]]));
        assert_eq!(parts(&[1; 9]), Some(vec![vec![0, 1, 2, 3], vec![4, 5, 6, 7], vec![8]]));
        assert_eq!(parts(&[6, 6, 6]), Some(vec![vec![0, 1], vec![2]]));
        assert_eq!(parts(&[MAX_TELEMETRY_WORDS, 1]), Some(vec![vec![0], vec![1]]));
        assert_eq!(parts(&[MAX_TELEMETRY_WORDS + 1]), None);
    }
}
