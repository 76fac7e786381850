//! `docs/messages.md` says what the messages are.

#[path = "../examples/messages_md/page.rs"]
mod page;

#[test]
fn the_page_of_messages_is_the_one_that_is_made() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/messages.md");
    let written = std::fs::read_to_string(path).expect("docs/messages.md exists");
    let differs = page::page().lines().zip(written.lines()).position(|(made, written)| made != written);
    assert!(
        page::page() == written,
        "docs/messages.md differs from line {differs:?} on: cargo run -p messages --example messages_md > docs/messages.md"
    );
}

#[test]
fn every_field_of_a_physical_quantity_names_its_unit() {
    use messages::{Message, Shape, topic};
    // Pure numbers: rotations, shares, residuals; coefficients and points of the pattern, whose fields say what they are.
    const PURE: [&str; 18] = [
        "rotation",
        "share",
        "residual",
        "xyzw",
        "reserved",
        "amount",
        "foothold",
        "zmp",
        "com_polynomial",
        "com_decaying",
        "com_growing",
        "excess",
        "zmp_1",
        "state",
        "reserve",
        "count",
        "code",
        "step",
    ];
    const UNITS: [&str; 13] =
        ["_m", "_rad", "_s", "_kg", "_n", "_nm", "_j", "_ns", "_ticks", "_per_s", "_per_s2", "_bits", "_tick"];
    fn check(shape: &Shape, missing: &mut Vec<String>) {
        let Shape::Struct { wire_name, fields, .. } = shape else { return };
        for field in *fields {
            let mut inner = field.shape;
            while let Shape::Array(element, _) = inner {
                inner = element;
            }
            match inner {
                Shape::F64 => {
                    let named = UNITS.iter().any(|unit| field.name.ends_with(unit))
                        || PURE.iter().any(|pure| field.name.ends_with(pure));
                    if !named {
                        missing.push(format!("{wire_name}.{}", field.name));
                    }
                }
                other => check(other, missing),
            }
        }
    }
    struct Each(Vec<String>);
    impl topic::Visitor for Each {
        type Error = std::convert::Infallible;
        fn message<T: Message>(&mut self, _: messages::Topic<T>) -> Result<(), Self::Error> {
            check(T::SHAPE, &mut self.0);
            Ok(())
        }
        fn slice<H: Message, E: topic::Element>(&mut self, _: messages::Topic<H>) -> Result<(), Self::Error> {
            check(H::SHAPE, &mut self.0);
            check(E::SHAPE, &mut self.0);
            Ok(())
        }
    }
    let mut each = Each(Vec::new());
    let Ok(()) = topic::visit(&mut each);
    assert_eq!(each.0, [] as [String; 0]);
}
