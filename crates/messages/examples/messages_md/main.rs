//! Prints `docs/messages.md` from topics, shapes and codes: `cargo run -p messages --example messages_md > docs/messages.md`
#![allow(clippy::print_stdout, reason = "the page is what it is asked for")]

mod page;

fn main() {
    print!("{}", page::page());
}
