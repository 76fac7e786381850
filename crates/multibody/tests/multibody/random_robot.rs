//! Random trees and random states, from a seed.

use multibody::{Configuration, Model, ModelOptions};
use nalgebra::DVector;
use spatial::{Transform, Vec3, so3};
use std::fmt::Write;

/// SplitMix64: small, and the same on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in -1 .. 1.
    pub fn symmetric(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub fn vector(&mut self, scale: f64) -> Vec3 {
        Vec3::new(self.symmetric(), self.symmetric(), self.symmetric()) * scale
    }

    pub fn list(&mut self, n: usize, scale: f64) -> DVector<f64> {
        DVector::from_fn(n, |_, _| scale * self.symmetric())
    }
}

fn triple(v: &Vec3) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

/// A tree of `n` links after the root: every joint type, arbitrary axes, a third of the joints fixed.
pub fn urdf(seed: u64, n: usize) -> String {
    let mut random = Random(seed);
    let mut text = format!("<robot name=\"random_{seed}\">\n");
    for i in 0..=n {
        let edges = random.vector(0.2).abs().add_scalar(0.05);
        let mass = 0.2 + random.symmetric().abs() * 3.0;
        let i_box = spatial::Inertia::uniform_box(mass, Vec3::zeros(), edges).about_com;
        writeln!(
            text,
            "<link name=\"l{i}\"><inertial><origin xyz=\"{}\" rpy=\"{}\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"{}\" iyy=\"{}\" izz=\"{}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>",
            triple(&random.vector(0.2)),
            triple(&random.vector(3.0)),
            i_box[(0, 0)],
            i_box[(1, 1)],
            i_box[(2, 2)],
        )
        .unwrap();
    }
    for i in 1..=n {
        let parent = if random.below(3) == 0 { random.below(i) } else { i - 1 };
        let kind = ["revolute", "continuous", "prismatic", "revolute", "fixed", "revolute"][random.below(6)];
        let axis = match random.below(5) {
            0 => Vec3::x(),
            1 => -Vec3::y(),
            2 => Vec3::z(),
            _ => random.vector(1.0),
        };
        writeln!(
            text,
            "<joint name=\"j{i}\" type=\"{kind}\"><parent link=\"l{parent}\"/><child link=\"l{i}\"/>\
             <origin xyz=\"{}\" rpy=\"{}\"/><axis xyz=\"{}\"/>\
             <limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"5\"/></joint>",
            triple(&random.vector(0.4)),
            triple(&random.vector(3.0)),
            triple(&axis),
        )
        .unwrap();
    }
    text.push_str("</robot>\n");
    text
}

/// A `<mimic>`: `q[follower] = multiplier * q[leader] + offset`.
pub struct Mimic {
    pub follower: String,
    pub leader: String,
    pub multiplier: f64,
    pub offset: f64,
}

/// The tree of [`urdf`] in which every third movable joint follows another one, above or below it, some over two steps.
pub fn coupled_urdf(seed: u64, n: usize) -> (String, Vec<Mimic>) {
    let mut random = Random(seed ^ 0xC0FFEE);
    let mut lines: Vec<String> = urdf(seed, n).lines().map(str::to_owned).collect();
    let is_movable = |line: &String| line.starts_with("<joint") && !line.contains("type=\"fixed\"");
    let movable: Vec<usize> = (0..lines.len()).filter(|&k| is_movable(&lines[k])).collect();
    let name = |line: &String| line.split('"').nth(1).expect("a joint has a name").to_owned();
    let (followers, free): (Vec<usize>, Vec<usize>) = (0..movable.len()).partition(|k| k % 3 == 1);
    let mut mimics = Vec::new();
    for (k, &follower) in followers.iter().enumerate() {
        // Every third follower follows the follower before it.
        let leader = if k % 3 == 2 { followers[k - 1] } else { free[random.below(free.len())] };
        let (multiplier, offset) =
            ((0.4 + random.symmetric().abs()) * random.symmetric().signum(), 0.3 * random.symmetric());
        let leader = name(&lines[movable[leader]]);
        let line = &mut lines[movable[follower]];
        let element = format!(r#"<mimic joint="{leader}" multiplier="{multiplier}" offset="{offset}"/></joint>"#);
        *line = line.replace("</joint>", &element);
        mimics.push(Mimic { follower: name(line), leader, multiplier, offset });
    }
    (lines.join("\n"), mimics)
}

/// Rotors on every joint, leaders and followers.
pub fn with_rotors(mut model: Model) -> Model {
    for i in 0..model.joint_count() {
        model.set_rotor_inertia(multibody::JointIndex(i), 0.01 * (i % 3) as f64);
    }
    for i in 0..model.followers().len() {
        model.set_follower_rotor_inertia(multibody::FollowerIndex(i), 0.02 * (i % 2) as f64);
    }
    model
}

/// A model and, per call, states far outside its limits.
pub fn model(seed: u64, options: &ModelOptions) -> Model {
    with_rotors(Model::from_urdf(&urdf(seed, 24), options).expect("the generator writes valid robots"))
}

/// The same with joints that follow others.
pub fn coupled_model(seed: u64, options: &ModelOptions) -> Model {
    with_rotors(Model::from_urdf(&coupled_urdf(seed, 24).0, options).expect("the generator writes valid robots"))
}

pub fn configuration(model: &Model, random: &mut Random) -> Configuration {
    let rotation = so3::exp(&(random.vector(1.0).normalize() * std::f64::consts::PI * random.symmetric()));
    Configuration { base: Transform::new(rotation, random.vector(2.0)), joints: random.list(model.joint_count(), 4.0) }
}
