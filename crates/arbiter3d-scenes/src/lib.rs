//! Named scenes, built through the public API of `arbiter3d`.
