//! Scene files: JSON that describes a world, with meshes in OBJ files beside it.
//!
//! Three steps, each a file: `format` says what may be written and turns JSON into plain structures, refusing unknown
//! fields and numbers that are not finite; `obj` reads meshes; `load` fills a world and knows, for whatever the engine
//! refuses, the JSON path of what it came from. The format is described in `docs/scene-format.md`, and for editors in
//! `docs/scene.schema.json`, which a test keeps equal to the structures.

mod format;
mod load;
mod obj;
mod parse;

pub(crate) use load::load;
