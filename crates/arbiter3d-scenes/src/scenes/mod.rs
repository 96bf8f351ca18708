//! The scenes, by what they are made of.

pub(crate) mod behaviour;
pub(crate) mod character;
pub(crate) mod colosseum;
pub(crate) mod drums;
pub(crate) mod fast;
pub(crate) mod fields;
pub(crate) mod fluids;
pub(crate) mod gears_and_tiles;
pub(crate) mod parade;
pub(crate) mod piles;
pub(crate) mod stacks;
pub(crate) mod surfaces;
pub(crate) mod trees;
pub(crate) mod vehicles;

#[cfg(test)]
mod tests;
