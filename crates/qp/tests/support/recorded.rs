//! Recorded control steps: dense programs in npz archives, one array per letter and contact phase (`P0`, `c0`, `A0`, ..),
//! first index the tick; `idx0` holds the ticks' numbers and `x0` a reference solution.

#![allow(dead_code)] // every binary uses its own part

use nalgebra::{DMatrix, DVector};
use qp::dense::{Problem, Size};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// "No bound" in the recordings.
const RECORDED_INFINITY: f64 = 1e20;

/// One recorded tick.
pub struct Tick {
    /// Tick number in the walk.
    pub number: i64,
    /// Contact phase: ticks of one phase have one size.
    pub phase: usize,
    /// The program.
    pub problem: Problem,
    /// The solution another solver found.
    pub reference: DVector<f64>,
}

/// All ticks of an archive in the order in which they happened.
pub fn load(path: &Path) -> Result<Vec<Tick>, Box<dyn std::error::Error>> {
    let mut archive = zip::ZipArchive::new(File::open(path)?)?;
    let mut ticks = Vec::new();
    for phase in 0.. {
        if archive.by_name(&format!("idx{phase}.npy")).is_err() {
            break;
        }
        let mut array = |letter: &str| -> Result<(Vec<usize>, Vec<f64>), Box<dyn std::error::Error>> {
            let mut bytes = Vec::new();
            archive.by_name(&format!("{letter}{phase}.npy"))?.read_to_end(&mut bytes)?;
            let file = npyz::NpyFile::new(&bytes[..])?;
            assert_eq!(file.order(), npyz::Order::C);
            let shape = file.shape().iter().map(|n| *n as usize).collect();
            Ok((shape, file.into_vec()?))
        };
        let mut all = Vec::new();
        for letter in ["P", "c", "A", "b", "C", "l", "u", "lb", "ub", "x"] {
            all.push(array(letter)?);
        }
        let mut bytes = Vec::new();
        archive.by_name(&format!("idx{phase}.npy"))?.read_to_end(&mut bytes)?;
        let numbers: Vec<i64> = npyz::NpyFile::new(&bytes[..])?.into_vec()?;
        for (k, number) in numbers.into_iter().enumerate() {
            let part = |i: usize| {
                let (shape, values) = &all[i];
                let size: usize = shape[1..].iter().product();
                (&shape[1..], &values[k * size..(k + 1) * size])
            };
            let matrix = |i| {
                let (shape, values): (&[usize], _) = part(i);
                DMatrix::from_row_slice(shape[0], shape[1], values)
            };
            let vector = |i| DVector::from_row_slice(part(i).1);
            let side =
                |i| vector(i).map(|x: f64| if x.abs() >= RECORDED_INFINITY { x.signum() * f64::INFINITY } else { x });
            let mut problem =
                Problem::new(Size { variables: part(1).0[0], equalities: part(3).0[0], inequalities: part(5).0[0] });
            (problem.P, problem.c) = (matrix(0), vector(1));
            (problem.A, problem.b) = (matrix(2), vector(3));
            (problem.C, problem.l, problem.u) = (matrix(4), side(5), side(6));
            (problem.lb, problem.ub) = (side(7), side(8));
            problem.check()?;
            ticks.push(Tick { number, phase, problem, reference: vector(9) });
        }
    }
    ticks.sort_by_key(|tick| tick.number);
    Ok(ticks)
}
