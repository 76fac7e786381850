//! Licences of everything that is built in.

use crate::metadata::Metadata;

/// Licences that ask for no more than attribution.
const ALLOWED: [&str; 14] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
    "bzip2-1.0.6",
];

/// Packages whose licence is missing or not allowed.
pub fn violations(metadata: &Metadata) -> Vec<String> {
    let mut violations = Vec::new();
    for package in metadata.packages.values() {
        match &package.license {
            None => violations.push(format!("`{}` states no licence", package.name)),
            Some(license) if !is_allowed(license) => {
                violations.push(format!("`{}` is licensed as `{license}`, which is not allowed", package.name));
            }
            Some(_) => {}
        }
    }
    violations
}

/// Whether an SPDX expression can be satisfied with allowed licences.
fn is_allowed(expression: &str) -> bool {
    // Cargo's old form `MIT/Apache-2.0` means OR.
    let expression = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = expression.split_whitespace().collect();
    let (allowed, rest) = any_of(&words);
    allowed && rest.is_empty()
}

/// `a OR b OR ..`
fn any_of<'a>(words: &'a [&'a str]) -> (bool, &'a [&'a str]) {
    let (mut allowed, mut rest) = all_of(words);
    while let ["OR", after @ ..] = rest {
        let (other, after) = all_of(after);
        (allowed, rest) = (allowed | other, after);
    }
    (allowed, rest)
}

/// `a AND b AND ..`
fn all_of<'a>(words: &'a [&'a str]) -> (bool, &'a [&'a str]) {
    let (mut allowed, mut rest) = one(words);
    while let ["AND", after @ ..] = rest {
        let (other, after) = one(after);
        (allowed, rest) = (allowed & other, after);
    }
    (allowed, rest)
}

/// A licence, with its exception if it has one, or an expression in parentheses.
fn one<'a>(words: &'a [&'a str]) -> (bool, &'a [&'a str]) {
    match words {
        ["(", inside @ ..] => match any_of(inside) {
            (allowed, [")", after @ ..]) => (allowed, after),
            (_, rest) => (false, rest),
        },
        [license, "WITH", exception, after @ ..] => {
            (ALLOWED.contains(&format!("{license} WITH {exception}").as_str()), after)
        }
        [license, after @ ..] => (ALLOWED.contains(license), after),
        [] => (false, words),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_built_in_may_be() {
        let metadata = Metadata::read().expect("cargo knows this workspace");
        assert_eq!(violations(&metadata), [] as [String; 0]);
    }

    #[test]
    fn expressions_are_read_as_spdx_defines_them() {
        for allowed in [
            "MIT",
            "MIT/Apache-2.0",
            "GPL-3.0 OR MIT",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
            "Apache-2.0 WITH LLVM-exception",
        ] {
            assert!(is_allowed(allowed), "{allowed}");
        }
        for refused in ["GPL-3.0", "MIT AND GPL-3.0", "(GPL-3.0 OR LGPL-3.0) AND MIT", "", "MIT GPL-3.0", "(MIT"] {
            assert!(!is_allowed(refused), "{refused}");
        }
    }
}
