//! Compiles the written schemas into the descriptors that every recording carries. No `protoc` is needed.

use prost::Message;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::env::var("OUT_DIR")?;
    for schema in ["soleus", "foxglove"] {
        let file = format!("proto/{schema}.proto");
        println!("cargo::rerun-if-changed={file}");
        let descriptors = protox::compile([&file], ["proto"])?;
        std::fs::write(Path::new(&out).join(format!("{schema}.bin")), descriptors.encode_to_vec())?;
    }
    Ok(())
}
