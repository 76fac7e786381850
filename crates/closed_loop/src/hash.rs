//! One number that tells whether two runs are the same to the bit.
//!
//! Code that is only moved changes no number of any command and of nothing that really happens. So every floating-point number of
//! each tick's [`RobotCommand`](messages::RobotCommand) and [`Truth`](messages::Truth) goes into one hash. Names and integers stay
//! outside: a field that is renamed, a code that leaves the wire and another fingerprint of the robot's files change no motion.

use messages::{Plain, Shape};

/// FNV-1a with 64 bits over the floating-point numbers of messages, in the order of their fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NumberHash(u64);

/// The empty hash and the factor of FNV-1a.
const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0100_0000_01b3;

impl Default for NumberHash {
    fn default() -> Self {
        Self(OFFSET_BASIS)
    }
}

impl NumberHash {
    /// Takes all floating-point numbers of a message.
    pub fn take<T: Plain>(&mut self, message: &T) {
        let mut bytes = Vec::with_capacity(T::SHAPE.size());
        message.write_bytes(&mut bytes);
        self.take_numbers(T::SHAPE, &bytes);
    }

    fn take_numbers(&mut self, shape: &Shape, bytes: &[u8]) {
        match shape {
            Shape::F64 => bytes.iter().for_each(|byte| self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(PRIME)),
            Shape::U32 | Shape::U64 | Shape::I64 => {}
            Shape::Array(element, _) => {
                bytes.chunks(element.size()).for_each(|bytes| self.take_numbers(element, bytes));
            }
            Shape::Struct { fields, .. } => {
                let mut rest = bytes;
                for field in *fields {
                    let (here, after) = rest.split_at(field.shape.size());
                    self.take_numbers(field.shape, here);
                    rest = after;
                }
            }
        }
    }
}

impl std::fmt::Display for NumberHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::RobotCommand;

    fn hash(change: impl FnOnce(&mut RobotCommand)) -> NumberHash {
        let mut command = RobotCommand::default();
        change(&mut command);
        let mut hash = NumberHash::default();
        hash.take(&command);
        hash
    }

    #[test]
    fn the_last_bit_of_any_number_counts_and_no_code_does() {
        let plain = hash(|_| {});
        assert_eq!(hash(|command| command.header.robot_fingerprint = 7), plain);
        assert_eq!(hash(|command| command.mode = 3), plain);
        let tiny = f64::from_bits(1);
        let changed = [
            hash(|command| command.joint_position_reference_rad[3] = tiny),
            hash(|command| command.joint_position_reference_rad[4] = tiny),
            hash(|command| command.plan.feet[1].ankle_rotation[8] = tiny),
            hash(|command| command.walk_time_s = -0.0),
        ];
        for (i, hash) in changed.iter().enumerate() {
            assert!(*hash != plain && !changed[..i].contains(hash), "change {i}");
        }
    }
}
