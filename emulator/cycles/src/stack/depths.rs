//! Maximum stack depth of a handler.

use std::collections::BTreeMap;

use super::StackError;
use crate::declarations::NamePattern;
use crate::graph::{Edge, Graph};

/// The deepest call chain, from one function on.
#[derive(Debug, Clone, Copy, Default)]
struct Deepest {
    bytes: u32,
    /// The deepest call; `None` if the function's own frame is deepest.
    by: Option<Edge>,
}

/// A function on the stack, and the number of functions on the stack for each declared nesting.
type Place = (u32, Vec<u32>);

/// The stack depths of all functions called from one handler.
pub(super) struct Depths<'g, 'a> {
    graph: &'g Graph<'a>,
    root: u32,
    /// Functions whose calls are ignored.
    pub(super) left_out: &'g [NamePattern],
    /// Functions whose callees are ignored.
    pub(super) last: &'g [NamePattern],
    known: BTreeMap<Place, Deepest>,
    path: Vec<Place>,
}

impl<'g, 'a> Depths<'g, 'a> {
    pub(super) fn new(graph: &'g Graph<'a>, root: u32) -> Self {
        Self { graph, root, left_out: &[], last: &[], known: BTreeMap::new(), path: Vec::new() }
    }

    /// Maximum stack bytes of the handler.
    pub(super) fn bytes(&mut self) -> Result<u32, StackError> {
        Ok(self.of(self.begin())?.bytes)
    }

    fn begin(&self) -> Place {
        (self.root, vec![0; self.graph.declared.nesting.len()])
    }

    fn of(&mut self, place: Place) -> Result<Deepest, StackError> {
        if let Some(deepest) = self.known.get(&place) {
            return Ok(*deepest);
        }
        if let Some(begin) = self.path.iter().position(|known| *known == place) {
            let name = |(function, _): &Place| self.graph.image().location(*function);
            let chain = self.path.iter().skip(begin).chain([&place]).map(name).collect();
            return Err(StackError::Recursion { chain });
        }
        let (function, nested) = &place;
        let (frame, edges) = self.graph.calls(self.root, *function)?;
        let mut deepest = Deepest { bytes: frame.bytes, by: None };
        let edges = if self.is_one_of(*function, self.last) { Vec::new() } else { edges };
        self.path.push(place.clone());
        for edge in edges {
            let Some(called) = self.called(edge, nested) else { continue };
            let bytes = edge.depth_bytes.saturating_add(self.of(called)?.bytes);
            if bytes > deepest.bytes {
                deepest = Deepest { bytes, by: Some(edge) };
            }
        }
        self.path.pop();
        self.known.insert(place, deepest);
        Ok(deepest)
    }

    /// The target of a call with `nested` functions of each declared nesting on the stack; `None` if the call
    /// does not happen.
    fn called(&self, edge: Edge, nested: &[u32]) -> Option<Place> {
        if self.is_one_of(edge.callee, self.left_out) {
            return None;
        }
        let mut nested = nested.to_vec();
        for (count, (most, name)) in nested.iter_mut().zip(&self.graph.declared.nesting) {
            if self.graph.has_name(edge.callee, name) {
                *count += 1;
                if *count > *most {
                    return None;
                }
            }
        }
        Some((edge.callee, nested))
    }

    fn is_one_of(&self, function: u32, names: &[NamePattern]) -> bool {
        names.iter().any(|name| self.graph.has_name(function, name))
    }

    /// The deepest chain, after all depths are known: functions, each with its bytes on the stack.
    pub(super) fn chain(&self) -> Vec<(String, u32)> {
        let mut chain = Vec::new();
        let mut place = Some(self.begin());
        while let Some((function, nested)) = place {
            let Some(deepest) = self.known.get(&(function, nested.clone())) else { break };
            let bytes = deepest.by.map_or(deepest.bytes, |edge| edge.depth_bytes);
            chain.push((self.graph.image().location(function), bytes));
            place = deepest.by.and_then(|edge| self.called(edge, &nested));
        }
        chain
    }
}
