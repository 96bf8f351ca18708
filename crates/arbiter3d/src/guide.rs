//! Compiles and runs every Rust snippet of the README and of the guide in `docs/` as a documentation test.

macro_rules! chapters {
    ($($name:ident: $file:literal,)*) => {
        $(
            #[doc = include_str!(concat!("../../../", $file))]
            struct $name;
        )*
    };
}

chapters! {
    Readme: "README.md",
    GettingStarted: "docs/getting-started.md",
    BodiesAndShapes: "docs/bodies-and-shapes.md",
    Arbiters: "docs/arbiters.md",
    CustomShapes: "docs/custom-shapes.md",
    ContactsAndEvents: "docs/contacts-and-events.md",
    CustomCollision: "docs/custom-collision.md",
    Step: "docs/step.md",
    Sleeping: "docs/sleeping.md",
    ContinuousCollision: "docs/continuous-collision.md",
    Queries: "docs/queries.md",
    Determinism: "docs/determinism.md",
    UnitsAndLimits: "docs/units-and-limits.md",
    Performance: "docs/performance.md",
}
