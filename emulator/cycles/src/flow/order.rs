//! The order of a function's blocks.

use std::collections::{BTreeMap, BTreeSet};

use super::FlowGraph;

impl FlowGraph {
    /// Sorts the blocks: a strongly connected component is contiguous, and is itself sorted in the same way
    /// without the edges back to its entry block.
    pub(super) fn sort(&mut self) {
        let edges: BTreeMap<u32, Vec<u32>> =
            self.blocks.iter().map(|(begin, block)| (*begin, block.successors.clone())).collect();
        let mut order = Order { edges, places: BTreeMap::new(), loops: Vec::new(), next: 0 };
        order.place_all(self.blocks.keys().copied().collect(), self.entry, None);
        for (begin, block) in &mut self.blocks {
            if let Some((place, loops)) = order.places.remove(begin) {
                block.place = place;
                block.loops = loops;
            }
        }
    }
}

struct Order {
    edges: BTreeMap<u32, Vec<u32>>,
    places: BTreeMap<u32, (u32, Vec<(u32, u32)>)>,
    /// Loops around the blocks that are being placed.
    loops: Vec<(u32, u32)>,
    next: u32,
}

impl Order {
    /// Places the blocks reachable from `entry`; ignores edges back to `head`.
    fn place_all(&mut self, blocks: BTreeSet<u32>, entry: u32, head: Option<u32>) {
        let mut search = Search::new(&self.edges, &blocks, head);
        search.visit(entry);
        for block in &blocks {
            search.visit(*block);
        }
        let mut components = search.components;
        // Tarjan's search finds the components in reverse order.
        components.reverse();
        for component in components {
            let first = component.first().copied().unwrap_or(entry);
            let has_loop = component.len() > 1 || self.goes_back(first, first, head);
            if !has_loop {
                self.places.insert(first, (self.next, self.loops.clone()));
                self.next += 1;
                continue;
            }
            // The search entered the component through its first block.
            self.loops.push((self.next, first));
            if component.len() > 1 {
                self.place_all(component.into_iter().collect(), first, Some(first));
            } else {
                self.places.insert(first, (self.next, self.loops.clone()));
                self.next += 1;
            }
            self.loops.pop();
        }
    }

    fn goes_back(&self, from: u32, to: u32, head: Option<u32>) -> bool {
        head != Some(to) && self.edges.get(&from).is_some_and(|targets| targets.contains(&to))
    }
}

/// Tarjan's search for strongly connected components.
struct Search<'a> {
    edges: &'a BTreeMap<u32, Vec<u32>>,
    blocks: &'a BTreeSet<u32>,
    head: Option<u32>,
    numbers: BTreeMap<u32, u32>,
    stack: Vec<u32>,
    /// Components, each with its entry block first.
    components: Vec<Vec<u32>>,
}

impl<'a> Search<'a> {
    fn new(edges: &'a BTreeMap<u32, Vec<u32>>, blocks: &'a BTreeSet<u32>, head: Option<u32>) -> Self {
        Self { edges, blocks, head, numbers: BTreeMap::new(), stack: Vec::new(), components: Vec::new() }
    }

    /// Visits a block. Returns the smallest number reachable from it among blocks without a known component.
    fn visit(&mut self, block: u32) -> u32 {
        if let Some(number) = self.numbers.get(&block) {
            return if self.stack.contains(&block) { *number } else { u32::MAX };
        }
        let number = u32::try_from(self.numbers.len()).unwrap_or(u32::MAX);
        self.numbers.insert(block, number);
        self.stack.push(block);
        let mut least = number;
        let edges = self.edges;
        for target in edges.get(&block).into_iter().flatten() {
            if self.blocks.contains(target) && self.head != Some(*target) {
                least = least.min(self.visit(*target));
            }
        }
        if least == number
            && let Some(place) = self.stack.iter().position(|other| *other == block)
        {
            self.components.push(self.stack.split_off(place));
        }
        least
    }
}
