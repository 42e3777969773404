//! The call graph of an image.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::rc::Rc;

use crate::declarations::{CallDeclarations, Callee, NamePattern};
use crate::frame::{Frame, FrameError, Frames};
use crate::image::{Function, Image};

/// The calls of an image, including declared calls.
#[derive(Debug)]
pub(crate) struct Graph<'a> {
    /// The functions.
    pub frames: Frames<'a>,
    /// Declarations for calls through pointers.
    pub declared: &'a CallDeclarations,
}

/// Reason that calls cannot be followed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GraphError {
    /// The analysis of a function failed.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A call through a pointer without a declaration.
    #[error("{place}: undeclared call through a pointer; declare callees of {caller} (called from {root})")]
    Undeclared {
        /// Location.
        place: String,
        /// The calling function.
        caller: String,
        /// The interrupt handler or program entry from which it is called.
        root: String,
    },
    /// A call to an address where no function starts.
    #[error("{place}: call to {target:#010x}, where no function starts: give it a function symbol (`.type`)")]
    NoFunction {
        /// Location.
        place: String,
        /// Target of the call.
        target: u32,
    },
    /// A declaration that matches no function.
    #[error("no function in the image matches '{callee}', a declared callee of {caller}")]
    Unmatched {
        /// Declared callee.
        callee: String,
        /// Its caller.
        caller: String,
    },
}

/// A call with its resolved target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Edge {
    /// Address of the instruction.
    pub at: u32,
    /// Bytes of the caller on the stack.
    pub depth_bytes: u32,
    /// Start address of the called function.
    pub callee: u32,
}

impl<'a> Graph<'a> {
    /// Creates the call graph of an image.
    #[must_use]
    pub(crate) fn new(image: &'a Image, declared: &'a CallDeclarations) -> Self {
        Self { frames: Frames::new(image), declared }
    }

    /// The image.
    #[must_use]
    pub(crate) fn image(&self) -> &'a Image {
        self.frames.image()
    }

    /// Whether the function at an address has a matching name.
    #[must_use]
    pub(crate) fn has_name(&self, address: u32, name: &NamePattern) -> bool {
        self.image().functions.get(&address).is_some_and(|function| name.matches(function))
    }

    /// A function and its calls, when called from `root`: an interrupt handler or the program entry. A
    /// function starts at each call target.
    ///
    /// # Errors
    /// [`GraphError`].
    pub(crate) fn calls(&self, root: u32, function: u32) -> Result<(Rc<Frame>, Vec<Edge>), GraphError> {
        let frame = self.frames.of(function)?;
        let mut edges = Vec::new();
        for (&at, call) in &frame.calls {
            let callees = match call.callee {
                Some(target) if !self.image().functions.contains_key(&target) => {
                    return Err(GraphError::NoFunction { place: self.image().location(at), target });
                }
                Some(callee) => vec![callee],
                None => self.pointed(root, function, at)?,
            };
            let edge = |callee| Edge { at, depth_bytes: call.depth_bytes, callee };
            edges.extend(callees.into_iter().map(edge));
        }
        Ok((frame, edges))
    }

    /// All functions reachable from `root`, each with its caller and call on a shortest path.
    ///
    /// # Errors
    /// [`GraphError`].
    pub(crate) fn reached(&self, root: u32) -> Result<BTreeMap<u32, Option<(u32, Edge)>>, GraphError> {
        let mut reached = BTreeMap::from([(root, None)]);
        let mut waiting = VecDeque::from([root]);
        while let Some(caller) = waiting.pop_front() {
            for edge in self.calls(root, caller)?.1 {
                if let Entry::Vacant(entry) = reached.entry(edge.callee) {
                    entry.insert(Some((caller, edge)));
                    waiting.push_back(edge.callee);
                }
            }
        }
        Ok(reached)
    }

    /// Possible targets of a call through a pointer.
    fn pointed(&self, root: u32, caller: u32, at: u32) -> Result<Vec<u32>, GraphError> {
        let image = self.image();
        let declared = self.declared.callers.iter().find(|declared| {
            self.has_name(caller, &declared.name)
                && declared.from.as_ref().is_none_or(|from| self.has_name(root, from))
        });
        let Some(declared) = declared else {
            let [caller, root] = [caller, root].map(|address| image.location(address));
            return Err(GraphError::Undeclared { place: image.location(at), caller, root });
        };
        let mut callees = BTreeSet::new();
        for callee in &declared.callees {
            let named = image.functions.values().filter(|function| callee.name.matches(function));
            let mut is_matched = false;
            for function in named {
                if self.is_meant(callee, function)? {
                    is_matched = true;
                    callees.insert(function.address);
                }
            }
            if !is_matched && !callee.is_optional {
                let [callee, caller] = [&callee.name, &declared.name].map(NamePattern::to_string);
                return Err(GraphError::Unmatched { callee, caller });
            }
        }
        Ok(callees.into_iter().collect())
    }

    /// Whether a function satisfies `reaching` or `not reaching`, counting only calls that need no
    /// declaration.
    fn is_meant(&self, callee: &Callee, function: &Function) -> Result<bool, GraphError> {
        let Some((reaches, other)) = &callee.reaching else { return Ok(true) };
        let mut seen = BTreeSet::from([function.address]);
        let mut waiting = vec![function.address];
        while let Some(address) = waiting.pop() {
            let known =
                self.frames.of(address)?.calls.values().filter_map(|call| call.callee).collect::<Vec<_>>();
            waiting.extend(known.into_iter().filter(|callee| seen.insert(*callee)));
        }
        Ok(seen.iter().any(|address| self.has_name(*address, other)) == *reaches)
    }
}
