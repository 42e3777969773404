//! Brings a controller's scheme to the board, by commands, and learns where the board keeps its signals.

use dimsart_core::{Command, KindId, TypeRef, Word};
use dimsart_link::auth::Key;
use dimsart_link::exchange::Tag;
use dimsart_link::protocol::{
    self, DeviceInfo, KeyAction, KeyState, MAX_FRAME_BYTES, PROTOCOL_VERSION, Receiver, Refusal, Request,
    RequestSealer, Response, decode_response, request_id,
};

use super::EmulatedError;
use super::board::{BoardKey, Wire, words};
use crate::rig::SimulatedDimsart;

/// This process, to the board.
pub(super) const CLIENT: u8 = 1;
/// Ticks in which a request is answered: it is carried out in the one that it comes with.
const ANSWER_TICKS: u32 = 8;

/// Where the board's signals are in the copy's Data Base, in the order in which the board shows them.
#[derive(Debug)]
pub(super) struct Layout {
    /// Slot of the copy, none for a signal that it lacks, and words.
    signals: Vec<(Option<u8>, usize)>,
    words: usize,
}

impl Layout {
    /// Overwrites the copy with what the board shows: a revision, then the words.
    pub(super) fn show(&self, content: &[u8], copy: &mut SimulatedDimsart) -> Result<(), EmulatedError> {
        let (expected, found) = (4 * (1 + self.words), content.len());
        if found != expected {
            return Err(EmulatedError::OtherAnswer { what: "the Data Base", expected, found });
        }
        let mut words = words(content).skip(1);
        for (slot, count) in &self.signals {
            let words = words.by_ref().take(*count);
            match slot {
                Some(slot) => copy.overwrite(*slot, words),
                None => words.for_each(drop),
            }
        }
        Ok(())
    }
}

/// Gives the board the scheme of `copy`, and a key. Nothing is measured meanwhile, so nothing is computed.
pub(super) fn upload(
    wire: &mut Wire,
    copy: &mut SimulatedDimsart,
    key: Option<BoardKey>,
) -> Result<Layout, EmulatedError> {
    let nothing_measured = vec![Word::from(f32::NAN); copy.frame().output_words()];
    let mut line = CommandLine { wire, nothing_measured, number: 0, content: Vec::new() };
    line.compare_devices(copy)?;
    line.compare_libraries(copy)?;
    line.carry_out([Command::Close])?;
    if let Some(key) = key {
        line.lock(key)?;
    }
    line.carry_out(copy.engine_mut().commands())?;
    line.carry_out([Command::Check])?;
    line.layout(copy)
}

/// What the library of this command answers.
fn answer_here(copy: &mut SimulatedDimsart, request: &Request) -> Response<'static> {
    protocol::serve(request_id(CLIENT, 0), request, copy, &mut <DeviceInfo>::new("").with_laws())
}

fn unexpected(answer: &Response<'_>) -> EmulatedError {
    match answer {
        Response::Refused(refusal) => EmulatedError::Refused(*refusal),
        _ => EmulatedError::NoAnswer { ticks: ANSWER_TICKS },
    }
}

/// The board's command line, one request at a time.
struct CommandLine<'a> {
    wire: &'a mut Wire,
    nothing_measured: Vec<Word>,
    number: u8,
    content: Vec<u8>,
}

impl CommandLine<'_> {
    fn carry_out(&mut self, commands: impl IntoIterator<Item = Command>) -> Result<(), EmulatedError> {
        for command in commands {
            match self.ask(&Request::Command(command))? {
                Response::Effect(protocol::Effect { refused: None, .. }) => {}
                Response::Effect(protocol::Effect { refused: Some(error), .. }) => {
                    return Err(EmulatedError::Refused(Refusal::Engine(error)));
                }
                answer => return Err(unexpected(&answer)),
            }
        }
        Ok(())
    }

    /// Gives the board a key, and finds together with it.
    fn lock(&mut self, BoardKey { bytes, salt }: BoardKey) -> Result<(), EmulatedError> {
        match self.ask(&Request::Key(KeyAction::Set { key: bytes, salt }))? {
            Response::Key(KeyState::Locked) => {}
            answer => return Err(unexpected(&answer)),
        }
        let mut sealer = RequestSealer::new(&Key::new(&bytes.0), salt);
        let mut receiver = Receiver::new();
        for _ in 0..ANSWER_TICKS {
            // A hello at first, and at last the answer to the challenge.
            let is_answered = sealer.is_answered();
            if let Ok(Some(handshake)) = sealer.handshake(&mut [0; MAX_FRAME_BYTES]) {
                self.wire.send(Tag::Command, handshake);
            }
            self.wire.exchange(&self.nothing_measured)?;
            if is_answered {
                self.wire.sealer = Some(sealer);
                return Ok(());
            }
            for bytes in self.wire.sections(|tag| tag == Tag::Command) {
                receiver.take_all(bytes, |content| {
                    sealer.take(content);
                });
            }
        }
        Err(EmulatedError::NoAnswer { ticks: ANSWER_TICKS })
    }

    fn ask(&mut self, request: &Request) -> Result<Response<'_>, EmulatedError> {
        self.number = self.number.wrapping_add(1);
        let id = request_id(CLIENT, self.number);
        self.wire.ask(request, id);
        let mut receiver = Receiver::new();
        let mut is_there = false;
        for _ in 0..ANSWER_TICKS {
            self.wire.exchange(&self.nothing_measured)?;
            for bytes in self.wire.sections(|tag| tag == Tag::Command) {
                receiver.take_all(bytes, |content| {
                    // Heartbeats come in between.
                    if matches!(decode_response(content), Ok((found, _)) if found == id) {
                        is_there = true;
                        content.clone_into(&mut self.content);
                    }
                });
            }
            if is_there {
                break;
            }
        }
        match decode_response(&self.content) {
            Ok((_, response)) if is_there => Ok(response),
            _ => Err(EmulatedError::NoAnswer { ticks: ANSWER_TICKS }),
        }
    }

    fn compare_devices(&mut self, copy: &SimulatedDimsart) -> Result<(), EmulatedError> {
        let scenario_s = copy.engine().device().sample_period_s();
        match self.ask(&Request::Identify)? {
            Response::Identity(board) if board.protocol_version != PROTOCOL_VERSION => {
                Err(EmulatedError::OtherLibrary { what: "protocol".to_owned() })
            }
            Response::Identity(board) if board.sample_period_s.to_bits() != scenario_s.to_bits() => {
                Err(EmulatedError::SamplePeriod { board_s: board.sample_period_s, scenario_s })
            }
            Response::Identity(_) => Ok(()),
            answer => Err(unexpected(&answer)),
        }
    }

    /// Whether kinds, parameters and types are the same there as here: commands name them by their numbers. Kinds and types
    /// that the board's image has not are not compared.
    fn compare_libraries(&mut self, copy: &mut SimulatedDimsart) -> Result<(), EmulatedError> {
        for place in 0..=u8::MAX {
            let kind = match self.ask(&Request::Module { place })? {
                Response::Refused(_) => break,
                Response::Module(found) => KindId::of(found.name),
                answer => return Err(unexpected(&answer)),
            };
            if copy.engine().kinds().kind(kind).is_none() {
                return Err(EmulatedError::OtherLibrary { what: "the list of modules".to_owned() });
            }
            for index in 0..=u8::MAX {
                if !self.is_same(copy, Request::Parameter { kind, index }, "the list of parameters")? {
                    break;
                }
            }
        }
        let here: Vec<Response<'_>> = (0..=u16::MAX)
            .map(|index| answer_here(copy, &Request::DataType { index }))
            .take_while(|answer| !matches!(answer, Response::Refused(_)))
            .collect();
        for index in 0..=u16::MAX {
            match self.ask(&Request::DataType { index })? {
                Response::Refused(_) => break,
                there if here.contains(&there) => (),
                _ => return Err(EmulatedError::OtherLibrary { what: "the list of data types".to_owned() }),
            }
        }
        Ok(())
    }

    /// Whether there is anything of that number; it has to be the same there as here.
    fn is_same(
        &mut self,
        copy: &mut SimulatedDimsart,
        request: Request,
        what: &str,
    ) -> Result<bool, EmulatedError> {
        let here = answer_here(copy, &request);
        match self.ask(&request)? == here {
            true => Ok(!matches!(here, Response::Refused(_))),
            false => Err(EmulatedError::OtherLibrary { what: what.to_owned() }),
        }
    }

    fn layout(&mut self, copy: &SimulatedDimsart) -> Result<Layout, EmulatedError> {
        let data_base = copy.engine().data_base();
        let mut signals = Vec::new();
        for index in 0..=u8::MAX {
            let signal = match self.ask(&Request::Entry { index })? {
                Response::Entry(signal) => signal,
                Response::Refused(Refusal::NotThere) => break,
                answer => return Err(unexpected(&answer)),
            };
            signals.push((data_base.slot(signal), self.words(signal)?));
        }
        let shown = signals.iter().filter(|(slot, _)| slot.is_some()).count();
        if shown != data_base.signals().count() {
            return Err(EmulatedError::OtherLibrary { what: "the signals of this scheme".to_owned() });
        }
        let words = signals.iter().map(|(_, words)| words).sum();
        Ok(Layout { signals, words })
    }

    fn words(&mut self, signal: TypeRef) -> Result<usize, EmulatedError> {
        match self.ask(&Request::Signal { signal, from: 0 })? {
            Response::Signal(found) => Ok(found.words_in_all.into()),
            answer => Err(unexpected(&answer)),
        }
    }
}
