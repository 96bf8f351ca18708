//! The scenes, by what they are made of.

pub(crate) mod behaviour;
pub(crate) mod colosseum;
pub(crate) mod drums;
pub(crate) mod fast;
pub(crate) mod fields;
pub(crate) mod parade;
pub(crate) mod piles;
pub(crate) mod stacks;
pub(crate) mod surfaces;
pub(crate) mod trees;

#[cfg(test)]
mod tests;
