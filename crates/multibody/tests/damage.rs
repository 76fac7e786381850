//! Damaged URDFs: errors, never panics, within bounded memory and time.
//!
//! `DAMAGED_FILES=20000 cargo test -p multibody --test damage -- --nocapture` is the long form.

use multibody::{Model, ModelOptions, carried_joints, held_links};

#[test]
fn damaged_urdfs_are_errors() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/hrp4/hrp4.urdf");
    let whole = std::fs::read(path).expect("it ships");
    let words = [
        "<link",
        "<joint",
        "/>",
        "<mimic joint=\"R_KNEE_P\"/>",
        "revolute",
        "prismatic",
        "floating",
        "&amp;",
        "&#0;",
        "<!--",
    ];
    mutation::campaign("hrp4.urdf", 200, &whole, &words, |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let _ = Model::from_urdf(&text, &ModelOptions::default());
        let _ = carried_joints(&text);
        let _ = held_links(&text);
    });
}
