//! Two messages of ROS 2, for viewers that know a robot's shape and joints by nothing else.
//!
//! Encoded as ROS 2 does: CDR, little-endian, every number at a multiple of its size from the byte after the first
//! four. Nothing of ROS is needed for it, and nothing of it is installed.

/// Encoding of the schemas below.
pub(crate) const SCHEMA_ENCODING: &str = "ros2msg";
/// Encoding of the messages.
pub(crate) const ENCODING: &str = "cdr";

/// `std_msgs/msg/String`.
pub(crate) const STRING: (&str, &str) = ("std_msgs/msg/String", "string data\n");

/// `sensor_msgs/msg/JointState` with the messages in it.
pub(crate) const JOINT_STATE: (&str, &str) = (
    "sensor_msgs/msg/JointState",
    "\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
",
);

/// Appends a message of a text.
pub(crate) fn put_string(text: &str, out: &mut Vec<u8>) {
    let mut cdr = Cdr::new(out);
    cdr.text(text);
}

/// Joints as ROS has them.
pub(crate) struct Joints<'a> {
    pub(crate) time_ns: u64,
    pub(crate) names: &'a [String],
    pub(crate) positions: &'a [f64],
    pub(crate) velocities: &'a [f64],
    pub(crate) efforts: &'a [f64],
}

/// Appends a message of joints.
pub(crate) fn put_joints(joints: &Joints, out: &mut Vec<u8>) {
    let mut cdr = Cdr::new(out);
    cdr.time(joints.time_ns);
    cdr.text("");
    cdr.length(joints.names.len());
    joints.names.iter().for_each(|name| cdr.text(name));
    for numbers in [joints.positions, joints.velocities, joints.efforts] {
        cdr.length(numbers.len());
        if !numbers.is_empty() {
            cdr.align(8);
            numbers.iter().for_each(|number| cdr.out.extend_from_slice(&number.to_le_bytes()));
        }
    }
}

/// Plain CDR.
struct Cdr<'a> {
    out: &'a mut Vec<u8>,
    start: usize,
}

impl<'a> Cdr<'a> {
    fn new(out: &'a mut Vec<u8>) -> Self {
        // Plain CDR, little-endian, no options.
        out.extend_from_slice(&[0, 1, 0, 0]);
        let start = out.len();
        Self { out, start }
    }

    fn align(&mut self, size: usize) {
        let at = self.out.len() - self.start;
        self.out.resize(self.start + at.next_multiple_of(size), 0);
    }

    fn u32(&mut self, number: u32) {
        self.align(4);
        self.out.extend_from_slice(&number.to_le_bytes());
    }

    fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).expect("no robot has so many joints"));
    }

    fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.out.extend_from_slice(text.as_bytes());
        self.out.push(0);
    }

    fn time(&mut self, time_ns: u64) {
        // Seconds are signed and last until 2038.
        self.u32(u32::try_from(time_ns / 1_000_000_000).unwrap_or(u32::MAX).min(i32::MAX as u32));
        self.u32((time_ns % 1_000_000_000) as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_where_ros_expects_them() {
        let mut out = Vec::new();
        put_string("abc", &mut out);
        assert_eq!(out, b"\0\x01\0\0\x04\0\0\0abc\0");
        let mut out = vec![9; 3];
        let names = ["A", "BC"].map(str::to_string);
        let joints =
            Joints { time_ns: 2_500_000_000, names: &names, positions: &[1.0, 2.0], velocities: &[3.0], efforts: &[] };
        put_joints(&joints, &mut out);
        let mut expected = b"\0\x01\0\0\x02\0\0\0\0\x65\xcd\x1d\x01\0\0\0\0\0\0\0".to_vec();
        // At 16: two names, each with its length; at 36: two positions, at a multiple of 8.
        expected.extend(b"\x02\0\0\0\x02\0\0\0A\0\0\0\x03\0\0\0BC\0\0");
        expected.extend(b"\x02\0\0\0");
        expected.extend([1.0_f64, 2.0].iter().flat_map(|x| x.to_le_bytes()));
        expected.extend(b"\x01\0\0\0\0\0\0\0");
        expected.extend(3.0_f64.to_le_bytes());
        expected.extend(b"\0\0\0\0");
        assert_eq!(out[3..], expected);
    }
}
