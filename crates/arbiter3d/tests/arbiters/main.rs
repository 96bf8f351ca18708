//! What the arbiter system promises, through the public API alone.
//!
//! `mission` goes through the statements of the manual one by one; the other modules go into depth: identity and lifetime,
//! events, custom arbiters, the cache rules, solve modes, manifolds, sleep, and misuse.

mod cache;
#[path = "../common/mod.rs"]
mod common;
mod custom;
mod events;
mod lifecycle;
mod manifold;
mod mission;
mod misuse;
mod random;
mod reentrancy;
mod sleep;
mod solve_mode;
mod support;
