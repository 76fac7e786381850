//! Why a folder is no robot.

use std::path::PathBuf;

/// Why a folder is not a robot. Every variant names the file.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// A file is missing or not readable. Remedy: a robot folder has `robot.toml`, `sole.toml` and the URDF that
    /// `robot.toml` names.
    #[error("{}: cannot be read", .file.display())]
    Unreadable {
        /// Which file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file is named that does not lie in the folder of the file that names it. Remedy: put it there.
    #[error(
        "{}: {field} = \"{name}\" leads out of the folder: put the file beside this one or into a folder there, and \
         give its name from here", .file.display()
    )]
    Outside {
        /// Which file.
        file: PathBuf,
        /// The key, with its table.
        field: &'static str,
        /// What was found.
        name: String,
    },
    /// The text is in another encoding than UTF-8. Remedy: save it anew as UTF-8 (`iconv -f ENCODING -t UTF-8`).
    #[error("{}: the text is {encoding}, UTF-8 expected; convert it, as in `iconv -f {encoding} -t UTF-8`", .file.display())]
    Encoding {
        /// Which file.
        file: PathBuf,
        /// What it is, as `iconv` calls it.
        encoding: &'static str,
    },
    /// Not TOML, an unknown key, a missing key, or a value of another type.
    #[error("{}:{line}:{column}: {message}{}", .file.display(), suggestion(.nearest))]
    Toml {
        /// Which file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What the TOML reader found and expected.
        message: String,
        /// The known key most similar to an unknown one.
        nearest: Option<String>,
    },
    /// `[mesh]` describes no sole, or two.
    #[error("{}: [mesh] {found}: give either box_m with cells (a block), or file (a Gmsh mesh)", .file.display())]
    MeshChoice {
        /// Which file.
        file: PathBuf,
        /// What is there.
        found: &'static str,
    },
    /// The block of `mesh.box_m` and `mesh.cells` is none.
    #[error("{}: [mesh] no block of a sole", .file.display())]
    Block {
        /// Which file.
        file: PathBuf,
        /// What is wrong with it.
        source: sole_mesh::MeshError,
    },
    /// The mesh that `mesh.file` names cannot be used.
    #[error("{}: no mesh of a sole", .file.display())]
    Mesh {
        /// The mesh.
        file: PathBuf,
        /// What is wrong with it.
        source: Box<sole_mesh::MshError>,
    },
    /// The mesh is not drawn in the sole frame. Remedy: move it by the opposite of what is found.
    #[error(
        "{}: the contact points are centred about {centre_m:?} m: move the mesh so that the middle of their bounding rectangle, at the \
         height of the lowest one, is the origin (foot.ankle_in_sole_m counts from there)", .file.display()
    )]
    OffCentre {
        /// The mesh.
        file: PathBuf,
        /// Centre of the bounding rectangle, at the height of the lowest contact point (m).
        centre_m: [f64; 3],
    },
    /// A number is outside its range.
    #[error("{}: {field} = {value}, expected {expected}", .file.display())]
    OutOfRange {
        /// Which file.
        file: PathBuf,
        /// The key, with its table.
        field: String,
        /// What was found.
        value: f64,
        /// The range, in words.
        expected: &'static str,
    },
    /// A name refers to nothing.
    #[error("{}: {field} names `{name}`, which is not among {among}{}", .file.display(), suggestion(.nearest))]
    UnknownName {
        /// Which file.
        file: PathBuf,
        /// The key, with its table.
        field: String,
        /// What was found.
        name: String,
        /// Where it should have been defined.
        among: &'static str,
        /// The most similar defined name.
        nearest: Option<String>,
    },
    /// Something that every joint needs is given twice for one joint, or a name is used twice.
    #[error("{}: {field} gives `{name}` twice; remove one", .file.display())]
    Twice {
        /// Which file.
        file: PathBuf,
        /// The key, with its table.
        field: String,
        /// Which name.
        name: String,
    },
    /// Something that every joint needs is missing for one joint.
    #[error("{}: {field} says nothing about joint `{joint}`; add the joint or its group", .file.display())]
    Missing {
        /// Which file.
        file: PathBuf,
        /// The key, with its table.
        field: &'static str,
        /// Which joint.
        joint: String,
    },
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// The most similar of the known names, if any is similar at all.
pub(crate) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    const SIMILAR: f64 = 0.7;
    known
        .map(|candidate| (strsim::jaro_winkler(name, candidate), candidate))
        .filter(|(similarity, _)| *similarity > SIMILAR)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}
