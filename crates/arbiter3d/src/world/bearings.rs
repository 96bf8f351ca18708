//! By how many things that nothing can push each body may be borne.

/// The pairs of each body with what nothing can push, sensors left out; and how many bodies have several.
#[derive(Debug, Default)]
pub(crate) struct Bearings {
    counts: Vec<u32>,
    /// Bodies with two or more.
    several: usize,
}

impl Bearings {
    /// By body: how many pairs.
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// Whether some body has several: else nobody needs to look for one.
    pub fn any_several(&self) -> bool {
        self.several > 0
    }

    pub fn has_several(&self, body: u32) -> bool {
        self.counts.get(body as usize).is_some_and(|&count| count > 1)
    }

    /// Makes room for bodies.
    pub fn resize(&mut self, bodies: usize) {
        self.counts.resize(bodies, 0);
    }

    pub fn add(&mut self, body: u32) {
        let count = &mut self.counts[body as usize];
        *count += 1;
        self.several += usize::from(*count == 2);
    }

    pub fn remove(&mut self, body: u32) {
        let count = &mut self.counts[body as usize];
        self.several -= usize::from(*count == 2);
        *count -= 1;
    }

    /// Whether the number of bodies with several is right.
    pub fn is_valid(&self) -> bool {
        self.several == self.counts.iter().filter(|&&count| count > 1).count()
    }
}
