//! What every subcommand shares: reading the question from stdin, writing the answer to stdout.

use anyhow::Context;
use nalgebra::{DMatrix, DVector, Dim, Matrix, RawStorage};
use serde::{Serialize, de::DeserializeOwned};
use std::io::{Read, Write};

/// Decides the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything that was asked for was solved.
    Solved,
    /// The output contains at least one status that says otherwise.
    NotSolved,
}

/// Reads one JSON document from stdin; errors name line, column and field.
pub fn read<T: DeserializeOwned>() -> anyhow::Result<T> {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).context("reading stdin")?;
    parse(&text)
}

/// Reads one JSON document from text.
pub fn parse<T: DeserializeOwned>(text: &str) -> anyhow::Result<T> {
    serde_json::from_str(text).context("the input is not what this subcommand expects (see --help and --example)")
}

/// Writes one JSON document to stdout. A reader that goes away early is not an error.
pub fn write<T: Serialize>(value: &T) -> anyhow::Result<()> {
    let mut text = serde_json::to_vec(value).context("writing the result")?;
    text.push(b'\n');
    match std::io::stdout().lock().write_all(&text) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("writing to stdout"),
    }
}

/// An error and what caused it, as one sentence. Some errors say their cause's words in their own message; once is enough.
pub fn chain(error: &anyhow::Error) -> String {
    error
        .chain()
        .skip(1)
        .map(ToString::to_string)
        .fold(error.to_string(), |text, cause| if text.contains(&cause) { text } else { format!("{text}: {cause}") })
}

/// Row-major nested lists of any matrix.
pub fn rows<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(matrix: &Matrix<f64, R, C, S>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// List of any vector (or of a matrix, column after column).
pub fn list<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(vector: &Matrix<f64, R, C, S>) -> Vec<f64> {
    vector.iter().copied().collect()
}

/// Matrix from nested lists.
///
/// # Errors
/// The rows do not all have the same length; `name` says which matrix.
#[allow(dead_code)] // a door for subcommands that take matrices
pub fn matrix(name: &str, rows: &[Vec<f64>]) -> anyhow::Result<DMatrix<f64>> {
    let columns = rows.first().map_or(0, Vec::len);
    if let Some(i) = rows.iter().position(|row| row.len() != columns) {
        anyhow::bail!("{name}: row {i} has {} entries, row 0 has {columns}", rows[i].len());
    }
    Ok(DMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j]))
}

/// Vector of a known length.
///
/// # Errors
/// The list has another length; `name` says which.
pub fn vector(name: &str, list: &[f64], length: usize) -> anyhow::Result<DVector<f64>> {
    anyhow::ensure!(list.len() == length, "{name}: {length} numbers expected, {} found", list.len());
    Ok(DVector::from_column_slice(list))
}
