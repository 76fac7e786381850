//! `soleus-inspect layout`: the messages as declarations of another language, from the shapes that the bus uses.

mod c;
mod python;

use crate::door::Outcome;
use anyhow::Context;
use clap::Args;
use messages::topic::{self, Element, Row, Topic, Visitor};
use messages::{Message, Shape};
use std::convert::Infallible;
use std::io::{ErrorKind, Write};

/// Print the layout of every message, the codes and the topics as declarations of another language.
///
/// The page docs/messages.md says the same for people.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct Arguments {
    /// As ctypes structures: python/soleus/layouts.py is this output.
    #[arg(long)]
    python: bool,
    /// As a C11 header that asserts sizes and offsets.
    #[arg(long)]
    c: bool,
}

/// Prints.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let text = if arguments.python { python::module() } else { c::header() };
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(Outcome::Solved),
        other => other.map(|()| Outcome::Solved).context("writing to stdout"),
    }
}

/// A topic with the structs that travel on it.
struct Travels {
    row: Row,
    message: &'static Shape,
    /// Of a topic of slices what the slice is made of; `message` is its header.
    element: Option<&'static Shape>,
}

/// All topics, and all structs, those that others are made of first.
fn everything() -> (Vec<Travels>, Vec<&'static Shape>) {
    struct Each(Vec<Travels>);
    impl Visitor for Each {
        type Error = Infallible;
        fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), Infallible> {
            self.0.push(Travels { row: topic.row, message: T::SHAPE, element: None });
            Ok(())
        }
        fn slice<H: Message, E: Element>(&mut self, topic: Topic<H>) -> Result<(), Infallible> {
            self.0.push(Travels { row: topic.row, message: H::SHAPE, element: Some(E::SHAPE) });
            Ok(())
        }
    }
    let mut each = Each(Vec::new());
    let Ok(()) = topic::visit(&mut each);
    let mut structs = Vec::new();
    for travels in &each.0 {
        collect(travels.message, &mut structs);
        travels.element.into_iter().for_each(|element| collect(element, &mut structs));
    }
    (each.0, structs)
}

fn collect(shape: &'static Shape, structs: &mut Vec<&'static Shape>) {
    match shape {
        Shape::Array(element, _) => collect(element, structs),
        Shape::Struct { fields, .. } if !structs.contains(&shape) => {
            fields.iter().for_each(|field| collect(field.shape, structs));
            structs.push(shape);
        }
        _ => {}
    }
}

/// What a struct is called in other languages: `soleus.RobotStateV2` is `RobotState`.
fn struct_name(wire_name: &str) -> &str {
    let name = wire_name.trim_start_matches("soleus.");
    name.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('V')
}

/// What is at the bottom of arrays of arrays, and how many of it there are at each level, outermost first.
fn bottom(mut shape: &'static Shape) -> (&'static Shape, Vec<usize>) {
    let mut counts = Vec::new();
    while let Shape::Array(element, count) = shape {
        counts.push(*count);
        shape = element;
    }
    (shape, counts)
}

/// A doc comment as plain text: links become names.
fn plain(doc: &str) -> String {
    let words = doc.split_whitespace().collect::<Vec<_>>().join(" ");
    words.replace("[`crate::code::", "`").replace("[`crate::", "`").replace("[`", "`").replace("`]", "`")
}

/// The table of codes that a field's doc comment links to.
fn code_of(doc: &str) -> Option<&str> {
    let (_, rest) = doc.split_once("[`crate::code::")?;
    rest.split_once('`').map(|(name, _)| name)
}

/// Text in lines of at most `width` characters.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.last_mut().expect("there is one");
        if !last.is_empty() && last.chars().count() + 1 + word.chars().count() > width {
            lines.push(word.to_string());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_python_package_has_the_layouts_of_today() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../python/soleus/layouts.py");
        let written = std::fs::read_to_string(path).expect("python/soleus/layouts.py exists");
        assert!(
            python::module() == written,
            "python/soleus/layouts.py is not: soleus-inspect layout --python > python/soleus/layouts.py"
        );
    }

    #[test]
    fn names_lose_their_version_and_lines_their_length() {
        assert_eq!(struct_name("soleus.RobotStateV2"), "RobotState");
        assert_eq!(struct_name("soleus.PatternHeaderV12"), "PatternHeader");
        assert_eq!(wrapped("a bc def", 4), ["a bc", "def"]);
        assert_eq!(code_of("Who: [`crate::code::Process`]."), Some("Process"));
        assert_eq!(plain("Who: [`crate::code::Process`].\n a"), "Who: `Process`. a");
    }

    #[test]
    fn what_others_are_made_of_comes_first_and_once() {
        let (topics, structs) = everything();
        assert_eq!(topics.len(), topic::ROWS.len());
        for (at, shape) in structs.iter().enumerate() {
            let Shape::Struct { fields, .. } = shape else { panic!("{shape:?}") };
            assert!(!structs[at + 1..].contains(shape));
            for field in *fields {
                let (inner, _) = bottom(field.shape);
                assert!(!matches!(inner, Shape::Struct { .. }) || structs[..at].contains(&inner), "{}", field.name);
            }
        }
    }

    /// A compiler that is there checks what the header asserts.
    #[test]
    fn a_c_compiler_takes_the_header() {
        use std::process::{Command, Stdio};
        let mut compiler = Command::new("cc");
        compiler
            .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-x", "c", "-"])
            .stdin(Stdio::piped());
        let Ok(mut child) = compiler.stderr(Stdio::piped()).spawn() else {
            eprintln!("SKIPPED: no C compiler (cc): the header was not compiled");
            return;
        };
        child.stdin.take().expect("piped").write_all(c::header().as_bytes()).expect("it reads");
        let output = child.wait_with_output().expect("it ends");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}
