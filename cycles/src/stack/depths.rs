//! How deep a handler goes.

use std::collections::BTreeMap;

use super::StackError;
use crate::declared::Name;
use crate::graph::{Edge, Graph};

/// A call chain, from its deepest end.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Deepest {
    pub(super) bytes: u32,
    /// Whether anything that is called uses floats.
    pub(super) uses_floats: bool,
    /// The call that is deepest, none where the function itself is.
    by: Option<Edge>,
}

/// The depths of what is called on behalf of one handler.
pub(super) struct Depths<'g, 'a> {
    graph: &'g Graph<'a>,
    root: u32,
    /// Functions that are not called now.
    left_out: Vec<&'g Name>,
    /// By function and how many functions with a declared nesting are on the stack.
    known: BTreeMap<(u32, u32), Deepest>,
    path: Vec<(u32, u32)>,
}

impl<'g, 'a> Depths<'g, 'a> {
    pub(super) fn new(graph: &'g Graph<'a>, root: u32, left_out: Vec<&'g Name>) -> Self {
        Self { graph, root, left_out, known: BTreeMap::new(), path: Vec::new() }
    }

    /// The handler at its deepest.
    pub(super) fn deepest(&mut self) -> Result<Deepest, StackError> {
        self.of((self.root, 0))
    }

    fn of(&mut self, (function, nested): (u32, u32)) -> Result<Deepest, StackError> {
        let key = (function, nested);
        if let Some(deepest) = self.known.get(&key) {
            return Ok(*deepest);
        }
        if let Some(begin) = self.path.iter().position(|place| *place == key) {
            let place = |(function, _): &(u32, u32)| self.graph.image().place(*function);
            let chain = self.path.iter().skip(begin).chain([&key]).map(place).collect();
            return Err(StackError::Recursion { chain });
        }
        self.path.push(key);
        let (frame, edges) = self.graph.calls(self.root, function)?;
        let mut deepest = Deepest { bytes: frame.bytes, uses_floats: frame.uses_floats, by: None };
        for edge in edges {
            let Some(called) = self.called(edge, nested) else { continue };
            let called = self.of(called)?;
            deepest.uses_floats |= called.uses_floats;
            let bytes = edge.depth_bytes.saturating_add(called.bytes);
            if bytes > deepest.bytes {
                deepest = Deepest { bytes, by: Some(edge), ..deepest };
            }
        }
        self.path.pop();
        self.known.insert(key, deepest);
        Ok(deepest)
    }

    /// What a call leads to where `nested` functions with a declared nesting are on the stack; none if the call does not
    /// happen.
    fn called(&self, edge: Edge, nested: u32) -> Option<(u32, u32)> {
        let function = self.graph.image().functions.get(&edge.callee)?;
        if self.left_out.iter().any(|name| name.is_of(function)) {
            return None;
        }
        let declared = self.graph.declared.nesting.iter().find(|(_, name)| name.is_of(function));
        match declared {
            Some((most, _)) => (nested < *most).then_some((edge.callee, nested + 1)),
            None => Some((edge.callee, nested)),
        }
    }

    /// The deepest chain, once all depths are known: functions, each with the bytes that it has on the stack.
    pub(super) fn chain(&self) -> Vec<(String, u32)> {
        let mut chain = Vec::new();
        let mut place = Some((self.root, 0));
        while let Some(key) = place {
            let Some(deepest) = self.known.get(&key) else { break };
            let bytes = deepest.by.map_or(deepest.bytes, |edge| edge.depth_bytes);
            chain.push((self.graph.image().place(key.0), bytes));
            place = deepest.by.and_then(|edge| self.called(edge, key.1));
        }
        chain
    }
}
