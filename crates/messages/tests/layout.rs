//! The layout of messages against stored values: who changes it must give the type a new version.

use iceoryx2::prelude::ZeroCopySend;
use messages::topic::{self, Row};
use messages::*;

/// The message whose n-th eight-byte word holds the number n, so that any moved field is seen.
fn counted<T: Message>() -> T {
    let bytes: Vec<u8> = (0..size_of::<T>() as u64 / 8).flat_map(|word| (word + 1).to_le_bytes()).collect();
    T::read_bytes(&mut bytes.as_slice()).expect("as many bytes as the type has")
}

/// FNV-1a.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3))
}

/// Names, order and type of all numbers in a message.
fn names<T: Message>() -> String {
    let mut names = String::new();
    counted::<T>().for_each_number("", &mut |name, value| names += &format!("{name}={value:e};"));
    names
}

#[test]
fn names_order_and_types_of_all_fields_are_those_stored() {
    // Printed by this very test on failure; changing a line here means changing the version in the type's name.
    let stored = [
        ("soleus.PatternHeaderV1", 192, 3_374_829_347_784_695_683),
        ("soleus.WalkStartV1", 48, 2_218_368_706_852_104_645),
        ("soleus.WalkOrderV1", 40, 15_366_283_609_479_293_238),
        ("soleus.RobotStateV2", 856, 13_392_785_136_300_081_337),
        ("soleus.SoleDeformationV2", 1552, 9_955_717_656_554_383_974),
        ("soleus.SoleContactV1", 26672, 7_523_437_881_865_851_118),
        ("soleus.RobotCommandV2", 1568, 11_543_205_753_679_368_710),
        ("soleus.TruthV2", 1760, 3_883_121_107_563_766_830),
        ("soleus.HealthV2", 560, 17_673_937_309_037_152_329),
    ];
    fn now<T: Message>() -> (&'static str, usize, u64) {
        (T::WIRE_NAME, size_of::<T>(), hash(names::<T>().as_bytes()))
    }
    let now = [
        now::<PatternHeader>(),
        now::<WalkStart>(),
        now::<WalkOrder>(),
        now::<RobotState>(),
        now::<SoleDeformation>(),
        now::<SoleContact>(),
        now::<RobotCommand>(),
        now::<Truth>(),
        now::<Health>(),
    ];
    assert_eq!(stored, now);
}

#[test]
fn shapes_are_as_large_as_what_they_describe() {
    assert_eq!(SoleContact::SHAPE.size(), size_of::<SoleContact>());
    assert_eq!(PatternPhase::SHAPE.size(), size_of::<PatternPhase>());
    assert!(
        matches!(Truth::SHAPE, Shape::Struct { wire_name: Truth::WIRE_NAME, fields, .. } if fields[0].name == "header")
    );
}

#[test]
fn bytes_of_a_message_are_those_stored() {
    let header = Header { sequence: 1, tick: -2, robot_fingerprint: 0x0102_0304_0506_0708, clock_monotonic_ns: 3 };
    let mut state = RobotState { header, joint_count: 20, ..RobotState::default() };
    state.joint_position_rad[0] = 1.0;
    let mut bytes = Vec::new();
    state.write_bytes(&mut bytes);
    assert_eq!(bytes.len(), 856);
    let start: [u8; 48] = [
        1, 0, 0, 0, 0, 0, 0, 0, // sequence
        0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, // tick
        8, 7, 6, 5, 4, 3, 2, 1, // fingerprint
        3, 0, 0, 0, 0, 0, 0, 0, // clock
        20, 0, 0, 0, 0, 0, 0, 0, // joint count, fault bits
        0, 0, 0, 0, 0, 0, 0xf0, 0x3f, // 1.0
    ];
    assert_eq!(bytes[..48], start);
    assert!(bytes[48..].iter().all(|byte| *byte == 0));
}

#[test]
fn bytes_survive_the_way_there_and_back_and_too_few_are_refused() {
    let command: RobotCommand = counted();
    let mut bytes = Vec::new();
    command.write_bytes(&mut bytes);
    let mut rest = bytes.as_slice();
    assert_eq!(RobotCommand::read_bytes(&mut rest), Some(command));
    assert!(rest.is_empty());
    assert_eq!(RobotCommand::read_bytes(&mut &bytes[..bytes.len() - 1]), None);
}

#[test]
fn wire_names_are_those_that_iceoryx2_sees() {
    struct Check;
    impl topic::Visitor for Check {
        type Error = std::convert::Infallible;
        fn message<T: Message>(&mut self, _: Topic<T>) -> Result<(), Self::Error> {
            // SAFETY: `type_name` only returns a literal; the trait marks it unsafe for the promise its implementor gives.
            #[allow(unsafe_code)]
            let name = unsafe { <T as ZeroCopySend>::type_name() };
            assert_eq!(name, T::WIRE_NAME);
            Ok(())
        }
        fn slice<H: Message, E: topic::Element>(&mut self, topic: Topic<H>) -> Result<(), Self::Error> {
            self.message(topic)
        }
    }
    let Ok(()) = topic::visit(&mut Check);
}

#[test]
fn the_visitor_meets_each_row_of_the_table_once_and_in_order() {
    struct Collect(Vec<Row>);
    impl topic::Visitor for Collect {
        type Error = std::convert::Infallible;
        fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), Self::Error> {
            self.0.push(topic.row);
            Ok(())
        }
        fn slice<H: Message, E: topic::Element>(&mut self, topic: Topic<H>) -> Result<(), Self::Error> {
            self.0.push(topic.row);
            Ok(())
        }
    }
    let mut collect = Collect(Vec::new());
    let Ok(()) = topic::visit(&mut collect);
    assert_eq!(collect.0, topic::ROWS);
}

#[test]
fn one_number_that_is_not_finite_is_found() {
    let mut deformation = SoleDeformation::default();
    assert!(deformation.all_finite());
    deformation.feet[1].compliance_m_rad_per_n_nm[35] = f64::NAN;
    assert!(!deformation.all_finite());
}

#[test]
fn headers_of_other_robots_and_gaps_are_faults() {
    let header = Header { sequence: 5, robot_fingerprint: 7, ..Header::default() };
    assert_eq!(header.check(7, Some(4)), Ok(()));
    assert_eq!(header.check(7, None), Ok(()));
    assert_eq!(header.check(7, Some(2)), Err(Fault::Gap { expected: 3, found: 5 }));
    assert_eq!(header.check(8, Some(4)), Err(Fault::OtherRobot { expected: 8, found: 7 }));
}

#[test]
fn codes_come_back_and_unknown_ones_do_not() {
    for process in code::Process::ALL {
        assert_eq!(code::Process::from_code(process.code()), Some(*process));
    }
    assert_eq!(code::Process::from_code(0), None);
    assert_eq!(code::State::from_code(99), None);
}
