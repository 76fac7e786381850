//! Reading the folder.

use crate::error::nearest;
use crate::{RobotDescription, RobotError, SoleDescription, check};
use serde::de::DeserializeOwned;
use sole_mesh::{Mesh, MshSets, Outline};
use std::path::{Path, PathBuf};

/// A folder of `robots/`, read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// The folder.
    pub folder: PathBuf,
    /// Text of the URDF.
    pub urdf: String,
    /// `robot.toml`.
    pub description: RobotDescription,
    /// `sole.toml`.
    pub sole: SoleDescription,
    /// Where it was read from.
    pub sole_file: PathBuf,
    /// The mesh that it names; `None` for a block.
    pub sole_mesh: Option<Mesh>,
    /// Hash of URDF and `robot.toml`: messages carry it, so that processes with different robots do not talk.
    pub fingerprint: u64,
}

impl Robot {
    /// Reads a robot's folder.
    ///
    /// # Errors
    /// [`RobotError`] names file, field, what was found and what was expected.
    pub fn load(folder: &Path) -> Result<Self, RobotError> {
        Self::load_on(folder, None)
    }

    /// Reads a robot's folder, standing on another sole than that of its own `sole.toml` if a file is given.
    ///
    /// # Errors
    /// [`RobotError`] names file, field, what was found and what was expected.
    pub fn load_on(folder: &Path, sole_file: Option<&Path>) -> Result<Self, RobotError> {
        let file = folder.join("robot.toml");
        let text = read(&file)?;
        let description: RobotDescription = parse(&file, &text)?;
        check::robot(&file, &description)?;
        let urdf = read(&folder.join(&description.urdf))?;
        let sole_file = sole_file.map_or_else(|| folder.join("sole.toml"), Path::to_owned);
        let sole = SoleDescription::load(&sole_file)?;
        let sole_mesh = sole.mesh_file(&sole_file).map(|file| read_mesh(&file)).transpose()?;
        let fingerprint = fingerprint(&[&urdf, &text]);
        Ok(Self { folder: folder.to_owned(), urdf, description, sole, sole_file, sole_mesh, fingerprint })
    }

    /// The rectangle that planner and controller know the sole by.
    #[must_use]
    pub fn sole_outline(&self) -> Outline {
        match &self.sole_mesh {
            Some(mesh) => mesh.outline(),
            None => Outline::block(self.sole.mesh.box_m.expect("checked when read: a sole without a file is a block")),
        }
    }
}

impl SoleDescription {
    /// Reads a `sole.toml`, not the mesh that it may name.
    ///
    /// # Errors
    /// [`RobotError`] names file, field, what was found and what was expected.
    pub fn load(file: &Path) -> Result<Self, RobotError> {
        let sole: Self = parse(file, &read(file)?)?;
        check::sole(file, &sole)?;
        Ok(sole)
    }
}

/// Farthest that the middle of a mesh may lie from the origin of the sole frame (m): what rounding in a drawing makes of it, far below
/// what a foot can be mounted to.
const OFF_CENTRE_MAX_M: f64 = 1e-5;

/// Reads a Gmsh mesh of a left sole, drawn about the origin of the sole frame.
///
/// # Errors
/// [`RobotError`] names the file and what is wrong: the element, the node, how far its middle is off.
pub fn read_mesh(file: &Path) -> Result<Mesh, RobotError> {
    let refused = |source| RobotError::Mesh { file: file.to_owned(), source: Box::new(source) };
    let bytes = files::read(file, files::MESH_MAX_BYTES)
        .map_err(|source| RobotError::Unreadable { file: file.to_owned(), source })?;
    // A binary mesh says that it is one in its first lines, which are text.
    let mesh = Mesh::from_msh(&String::from_utf8_lossy(&bytes), MshSets::Either).map_err(refused)?;
    let centre = mesh.outline().centre_m;
    if centre.amax() > OFF_CENTRE_MAX_M {
        return Err(RobotError::OffCentre { file: file.to_owned(), centre_m: centre.into() });
    }
    Ok(mesh)
}

/// FNV-1a over the texts, each followed by a zero byte; carriage returns are skipped, so that a checkout on another
/// system is the same robot.
#[must_use]
pub fn fingerprint(texts: &[&str]) -> u64 {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let bytes = texts.iter().flat_map(|text| text.bytes().filter(|byte| *byte != b'\r').chain(std::iter::once(0)));
    bytes.fold(OFFSET, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME))
}

fn read(file: &Path) -> Result<String, RobotError> {
    let bytes = files::read(file, files::URDF_MAX_BYTES)
        .map_err(|source| RobotError::Unreadable { file: file.to_owned(), source })?;
    if let Some(encoding) = other_encoding(&bytes) {
        return Err(RobotError::Encoding { file: file.to_owned(), encoding });
    }
    String::from_utf8(bytes).map_err(|_| RobotError::Encoding { file: file.to_owned(), encoding: "ISO-8859-1" })
}

/// Encodings that give themselves away: by a byte-order mark, or by the zero bytes beside the letters of a text that is mostly ASCII. (What is
/// neither these nor UTF-8 is Latin-1 in nearly all files.)
fn other_encoding(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => Some("UTF-32"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("UTF-16"),
        [0, 0, 0, letter, ..] | [letter, 0, 0, 0, ..] if *letter != 0 => Some("UTF-32"),
        [0, letter, ..] if *letter != 0 => Some("UTF-16BE"),
        [letter, 0, ..] if *letter != 0 => Some("UTF-16LE"),
        _ => None,
    }
}

fn parse<T: DeserializeOwned>(file: &Path, text: &str) -> Result<T, RobotError> {
    toml::from_str(text).map_err(|error| {
        let before = &text[..error.span().map_or(0, |span| span.start)];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        let message = error.message().to_owned();
        RobotError::Toml { file: file.to_owned(), line, column, nearest: nearest_key(&message), message }
    })
}

/// serde lists the known keys after an unknown one, all in backticks.
fn nearest_key(message: &str) -> Option<String> {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = quoted.next().filter(|_| message.starts_with("unknown"))?;
    nearest(unknown, quoted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fingerprint_is_fnv_1a_and_knows_where_a_text_ends() {
        // Published value of FNV-1a 64 for "a" followed by the zero byte that ends the text.
        let a = 0xaf63_dc4c_8601_ec8c_u64;
        assert_eq!(fingerprint(&["a"]), a.wrapping_mul(0x0000_0100_0000_01b3));
        assert_eq!(fingerprint(&["x\r\ny"]), fingerprint(&["x\ny"]));
        assert_ne!(fingerprint(&["ab", "c"]), fingerprint(&["a", "bc"]));
    }

    #[test]
    fn unknown_keys_suggest_the_nearest_known_one() {
        let message = "unknown field `kp_nm`, expected one of `kp_nm_per_rad`, `radius_m`";
        assert_eq!(nearest_key(message).as_deref(), Some("kp_nm_per_rad"));
        assert_eq!(nearest_key("invalid type: string \"x\", expected f64"), None);
    }
}
