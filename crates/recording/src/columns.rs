//! Names for the numbers of a message, as columns of a table.
//!
//! | in the message | columns |
//! |---|---|
//! | `joint_position_rad[3]` | `joint_position_rad.R_KNEE_P`, as the robot's description calls the joint |
//! | `foot_wrench[0][2]`, feet left and right | `foot_wrench.left.force_z_n` |
//! | `base_twist[3]` | `base_twist.angular_x_rad_per_s` |
//! | `base_rotation[1]`, row-major | `base_rotation.xy` |
//! | `zmp_m[1]` | `zmp_m.y` |
//!
//! The unit is in the name of the field or, where the numbers of a field have different ones, at the end of the
//! column's.

use messages::{MAX_CONTACT_NODES, MAX_JOINTS, Shape};

const AXES: [&str; 3] = ["x", "y", "z"];
const FEET: [&str; 2] = ["left", "right"];

/// Names of all numbers of a message in the order in which `Plain::for_each_number` visits them; `None` stands for a
/// number that means nothing: reserved fields, and joints that the robot does not have.
#[must_use]
pub fn columns(shape: &Shape, joints: &[String]) -> Vec<Option<String>> {
    let mut columns = Vec::new();
    name(shape, "", "", joints, &mut columns);
    columns
}

fn name(shape: &Shape, path: &str, field: &str, joints: &[String], columns: &mut Vec<Option<String>>) {
    match shape {
        Shape::Struct { fields, .. } => {
            let dot = if path.is_empty() { "" } else { "." };
            for inner in *fields {
                name(inner.shape, &format!("{path}{dot}{}", inner.name), inner.name, joints, columns);
            }
        }
        Shape::Array(element, count) => {
            let labels = labels(element, *count, field);
            for index in 0..*count {
                match label(&labels, index, joints) {
                    Some(label) => name(element, &format!("{path}.{label}"), field, joints, columns),
                    None => columns.extend((0..numbers(element)).map(|_| None)),
                }
            }
        }
        _ => columns.push((field != "reserved").then(|| path.to_string())),
    }
}

/// What the elements of an array are called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Labels {
    /// As the joints of the robot's description, in its order; elements beyond them mean nothing.
    Joints,
    /// `node_0`, `node_1`, ..: contact nodes of a sole.
    Nodes,
    /// So.
    Named(Vec<String>),
}

/// What the elements of an array of `count` in the field `field` are called.
#[must_use]
pub fn labels(element: &Shape, count: usize, field: &str) -> Labels {
    let of_numbers = matches!(element, Shape::F64 | Shape::U32 | Shape::U64 | Shape::I64);
    let six = |first: [&str; 2], second: [&str; 2]| {
        let named = |[what, unit]: [&str; 2]| AXES.map(|axis| format!("{what}_{axis}_{unit}"));
        [named(first), named(second)].concat()
    };
    let plain = |names: &[&str]| names.iter().map(|name| (*name).to_string()).collect();
    Labels::Named(match (count, of_numbers) {
        (MAX_JOINTS, true) => return Labels::Joints,
        (MAX_CONTACT_NODES, _) => return Labels::Nodes,
        (2, false) => plain(&FEET),
        (2 | 3, true) => plain(&AXES[..count]),
        (4, true) => plain(&["x", "y", "z", "w"]),
        (6, true) if field.contains("wrench") => six(["force", "n"], ["moment", "nm"]),
        (6, true) if field.contains("twist") => six(["linear", "m_per_s"], ["angular", "rad_per_s"]),
        (6, true) if field.contains("acceleration") => six(["linear", "m_per_s2"], ["angular", "rad_per_s2"]),
        (9, true) => (0..9).map(|k| format!("{}{}", AXES[k / 3], AXES[k % 3])).collect(),
        (36, true) => (0..36).map(|k| format!("{}_{}", k / 6, k % 6)).collect(),
        _ => (0..count).map(|k| k.to_string()).collect(),
    })
}

/// What an element of an array is called.
fn label(labels: &Labels, index: usize, joints: &[String]) -> Option<String> {
    match labels {
        Labels::Joints => joints.get(index).cloned(),
        Labels::Nodes => Some(format!("node_{index}")),
        Labels::Named(names) => names.get(index).cloned(),
    }
}

fn numbers(shape: &Shape) -> usize {
    match shape {
        Shape::Struct { fields, .. } => fields.iter().map(|field| numbers(field.shape)).sum(),
        Shape::Array(element, count) => count * numbers(element),
        _ => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{
        Health, Message, Plain, RobotCommand, RobotState, SoleContact, SoleDeformation, Truth, WalkOrder, WalkStart,
    };

    fn assert_complete<T: Message>() {
        let columns = columns(T::SHAPE, &["HIP".to_string(), "KNEE".to_string()]);
        let mut count = 0;
        T::ZERO.for_each_number("", &mut |_, _| count += 1);
        assert_eq!(columns.len(), count, "{}", T::WIRE_NAME);
        let mut names: Vec<_> = columns.iter().flatten().collect();
        let named = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), named, "no name is given twice in {}", T::WIRE_NAME);
    }

    #[test]
    fn every_number_of_every_message_has_a_name_of_its_own() {
        assert_complete::<WalkStart>();
        assert_complete::<WalkOrder>();
        assert_complete::<RobotState>();
        assert_complete::<SoleDeformation>();
        assert_complete::<SoleContact>();
        assert_complete::<RobotCommand>();
        assert_complete::<Truth>();
        assert_complete::<Health>();
    }

    #[test]
    fn names_say_joint_foot_axis_and_unit() {
        let columns = columns(Truth::SHAPE, &["HIP".to_string(), "KNEE".to_string()]);
        let has = |name: &str| columns.iter().flatten().any(|column| column == name);
        for name in ["joint_position_rad.KNEE", "zmp_m.y", "base_rotation.xz", "sole_position_m.right.z", "header.tick"]
        {
            assert!(has(name), "{name}: {columns:?}");
        }
        let ends = |start: &str, end: &str| {
            columns.iter().flatten().any(|column| column.starts_with(start) && column.ends_with(end))
        };
        assert!(ends("foot_wrench", ".left.force_z_n") && ends("base_twist", ".angular_x_rad_per_s"));
        assert!(!columns.iter().flatten().any(|column| column.contains('[')));
    }
}
