//! Jolt is C++: the linker needs its library.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_JOLT").is_some() {
        println!("cargo::rustc-link-arg=-lstdc++");
    }
}
