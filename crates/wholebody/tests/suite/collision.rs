//! Capsules against another library, and bodies that must not touch.

use crate::support::watch::{Turns, Watch};
use crate::support::{Joints, PERIOD_S, Walk, model, robot, settings, start};
use gait::GaitSettings;
use parry3d_f64::math::{Pose3, Vec3 as ParryVec};
use parry3d_f64::query;
use parry3d_f64::shape::Capsule as ParryCapsule;
use pattern::Side;
use spatial::{Twist, Vec3, so3};
use std::collections::BTreeSet;
use wholebody::{
    Capsule, FootTarget, LinkCapsule, ProposalSettings, SMOOTHING_M, Verdict, WholeBody, propose_pairs, proximity,
};

struct Random(u64);

impl Random {
    fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

fn capsules(random: &mut Random) -> [Capsule; 2] {
    [0, 1].map(|_: usize| Capsule {
        from: random.point(),
        to: random.point(),
        radius: 0.05 + 0.03 * random.signed().abs(),
    })
}

#[test]
fn exact_distances_agree_with_parry() {
    let mut compared = 0;
    for seed in 0..2000 {
        let mut random = Random(seed);
        let pair = capsules(&mut random);
        let ours = proximity(&pair[0], &pair[1], 0.0);
        if ours.distance < 0.02 {
            continue; // their general algorithm measures separated shapes
        }
        let theirs = pair.map(|c| {
            let at = |p: Vec3| ParryVec::new(p.x, p.y, p.z);
            ParryCapsule::new(at(c.from), at(c.to), c.radius)
        });
        let distance =
            query::distance(&Pose3::IDENTITY, &theirs[0], &Pose3::IDENTITY, &theirs[1]).expect("supported").distance;
        assert!((ours.distance - distance).abs() < 2e-5, "seed {seed}: {} against {distance}", ours.distance);
        compared += 1;
    }
    assert!(compared > 1000);
}

#[test]
fn smoothing_never_reports_more_than_the_true_distance_and_little_less() {
    for seed in 0..5000 {
        let pair = capsules(&mut Random(seed));
        let exact = proximity(&pair[0], &pair[1], 0.0);
        let smooth = proximity(&pair[0], &pair[1], SMOOTHING_M);
        let axes = exact.distance + pair[0].radius + pair[1].radius;
        let lack = exact.distance - smooth.distance;
        assert!(lack > -1e-12, "seed {seed}");
        // d - sqrt(d² - rho²/2), at most d itself.
        let most = axes - (axes * axes - 0.5 * SMOOTHING_M * SMOOTHING_M).max(0.0).sqrt();
        assert!(lack <= most + 1e-12, "seed {seed}: {lack:e}");
        let across = smooth.on_first - smooth.on_second;
        assert!((across.normalize() - smooth.normal).norm() < 1e-12 || axes < 1e-9);
    }
}

#[test]
fn the_witness_points_pass_through_parallel_without_a_jump() {
    let fixed = Capsule { from: Vec3::new(-0.2, 0.0, 0.0), to: Vec3::new(0.2, 0.0, 0.0), radius: 0.05 };
    let turned = |angle: f64| {
        let (s, c) = angle.sin_cos();
        Capsule { from: Vec3::new(-0.2 * c, 0.2, -0.2 * s), to: Vec3::new(0.2 * c, 0.2, 0.2 * s), radius: 0.05 }
    };
    // The second capsule also leans a little, so that its nearer end changes side.
    let leaning = |angle: f64| {
        let mut capsule = turned(0.3);
        capsule.from.y += 0.2 * angle;
        capsule.to.y -= 0.2 * angle;
        capsule
    };
    let step = 1e-4;
    let jump = |smoothing: f64| {
        let mut largest: f64 = 0.0;
        let mut last = proximity(&fixed, &leaning(-0.05), smoothing).on_first;
        for k in -499..500 {
            let now = proximity(&fixed, &leaning(f64::from(k) * step), smoothing).on_first;
            largest = largest.max((now - last).norm());
            last = now;
        }
        largest
    };
    let parallel_jump = {
        let lean = |angle: f64| {
            let mut capsule = turned(0.0);
            capsule.from.y += 0.2 * angle;
            capsule.to.y -= 0.2 * angle;
            capsule
        };
        let mut largest: [f64; 2] = [0.0; 2];
        for (k, smoothing) in [0.0, SMOOTHING_M].into_iter().enumerate() {
            let mut last = proximity(&fixed, &lean(-0.01), smoothing).on_first;
            for i in -999..1000 {
                let now = proximity(&fixed, &lean(f64::from(i) * 1e-5), smoothing).on_first;
                largest[k] = largest[k].max((now - last).norm());
                last = now;
            }
        }
        largest
    };
    assert!(parallel_jump[0] > 0.1, "without smoothing they jump: {parallel_jump:?}");
    assert!(parallel_jump[1] < 0.02, "with it they slide: {parallel_jump:?}");
    assert!(jump(SMOOTHING_M) < 0.02);
}

/// Turns of a signal within 20 periods: a foot that is stopped makes joints turn a few times. It was 12 with witness points that
/// slid from heel to toe.
const TURNS_MAX: usize = 6;

/// Time in which a foot is turned (s).
const TURNING_S: f64 = 0.5;

/// A swinging foot whose target is moved and turned inwards. Every limit is checked at every tick, the safety distance among
/// them.
fn sent_inwards(first: Side, by_m: f64, turned_rad: f64) -> (Watch, Vec<f64>) {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let settings = settings(&robot, &model);
    let walk = gait::Walk::Straight { swings: 1, step_length_m: 0.05 };
    let mut gait = GaitSettings { walk, ..GaitSettings::default() };
    gait.start.first_swing = first;
    let plan = Walk::plan(&gait);
    let mut body = WholeBody::new(model, settings).expect("settings fit the model");
    let mut state = start(body.model(), body.settings(), &plan.reference(0.0));
    let mut watch = Watch::new(&body);
    let mut distances = Vec::new();
    for tick in 0..(plan.duration_s() / PERIOD_S) as usize {
        let mut reference = plan.reference(tick as f64 * PERIOD_S);
        match reference.feet.iter().position(|foot| !foot.in_contact) {
            Some(foot) => {
                let inwards = if foot == 0 { -1.0 } else { 1.0 };
                let mut pose = reference.feet[foot].ankle_pose;
                pose.translation.y += inwards * by_m;
                let part = (distances.len() as f64 * PERIOD_S / TURNING_S).min(1.0);
                pose.rotation = so3::about_z(inwards * part * turned_rad) * pose.rotation;
                reference.feet[foot] = FootTarget { ankle_twist: Twist::zero(), ..FootTarget::hanging(pose) };
            }
            None if distances.is_empty() => {}
            None => break,
        }
        let report = body.step(&state, &reference, PERIOD_S);
        watch.look(tick, &reference, report);
        if reference.feet.iter().any(|foot| !foot.in_contact) {
            distances.push(report.distance_min_m);
        }
        (state.q, state.v) = (report.q_next.clone(), report.v_next.clone());
    }
    (watch, distances)
}

#[test]
fn a_foot_sent_into_the_other_stops_at_the_safety_distance_without_chatter() {
    let (watch, distances) = sent_inwards(Side::Right, 0.07, 0.0);
    let safety = 0.01;
    assert!(watch.collision_bound > 100, "the damper is what stops it: {}", watch.figures());
    assert!(watch.distance_min_m < safety + 1e-3, "{}", watch.figures());
    assert!(watch.turns() <= TURNS_MAX, "{}", watch.figures());
    // It comes nearer and nearer and never turns back.
    let mut turns = Turns::default();
    distances.iter().for_each(|distance| turns.push(*distance, 1e-6));
    assert!(turns.most() <= 1, "{} turns", turns.most());
    let last = &distances[distances.len() - 40..];
    let spread = last.iter().copied().fold(0.0, f64::max) - last.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(spread < 1e-3, "held still at the end: {spread} m");
}

#[test]
fn a_foot_turned_into_the_other_stops_at_the_safety_distance_whichever_foot_it_is() {
    for first in [Side::Left, Side::Right] {
        let (watch, _) = sent_inwards(first, 0.0, 0.35);
        assert!(watch.collision_bound > 50, "{first:?}: the damper is what stops it: {}", watch.figures());
        assert!(watch.distance_min_m < 0.015, "{first:?}: half as near as in a walk: {}", watch.figures());
        assert!(watch.turns() <= TURNS_MAX, "{first:?}: {}", watch.figures());
    }
}

fn half_sitting(robot: &robot::Robot, model: &multibody::Model) -> multibody::Configuration {
    let mut standing = model.neutral();
    for (position, joint) in standing.joints.iter_mut().zip(model.joints()) {
        *position = robot.description.half_sitting_rad(&joint.name);
    }
    standing
}

/// Names in one order, whoever comes first.
fn sorted(pair: &[String; 2]) -> [String; 2] {
    let [a, b] = pair.clone();
    if a < b { [a, b] } else { [b, a] }
}

#[test]
fn the_pairs_that_hrp4_watches_are_those_its_joints_allow_to_meet_less_those_left_out_with_a_reason() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let capsules = settings(&robot, &model).collision.capsules;
    let proposals = propose_pairs(&model, &capsules, &half_sitting(&robot, &model), &ProposalSettings::default())
        .expect("links of the model");
    assert_eq!(proposals.len(), capsules.len() * (capsules.len() - 1) / 2);
    let proposed: BTreeSet<_> =
        proposals.iter().filter(|p| p.verdict == Verdict::Proposed).map(|p| sorted(&p.pair)).collect();
    let watched: BTreeSet<_> = robot.description.collision_pairs.iter().map(sorted).collect();
    let left_out: BTreeSet<_> =
        robot.description.collision_pairs_left_out.iter().flat_map(|group| &group.pairs).map(sorted).collect();
    assert!(robot.description.collision_pairs_left_out.iter().all(|group| group.reason.len() > 20));
    assert_eq!(watched.intersection(&left_out).count(), 0, "watched or left out");
    assert_eq!(watched.len(), robot.description.collision_pairs.len(), "each pair once");
    let known: BTreeSet<_> = watched.union(&left_out).cloned().collect();
    let missing: Vec<_> = proposed.difference(&known).collect();
    assert!(missing.is_empty(), "proposed, but neither watched nor left out: {missing:?}");
    let needless: Vec<_> = known.difference(&proposed).collect();
    assert!(needless.is_empty(), "watched or left out, but not proposed: {needless:?}");
}

#[test]
fn a_proposal_names_the_reason_for_every_pair_and_is_the_same_every_time() {
    let robot = robot();
    let model = model(&robot, Joints::Walking);
    let capsules = settings(&robot, &model).collision.capsules;
    let standing = half_sitting(&robot, &model);
    let few = ProposalSettings { samples: 500, ..ProposalSettings::default() };
    let once = propose_pairs(&model, &capsules, &standing, &few).expect("links of the model");
    assert_eq!(once, propose_pairs(&model, &capsules, &standing, &few).expect("links of the model"));
    let verdict = |a: &str, b: &str| {
        let found = once.iter().find(|p| p.pair.contains(&a.to_owned()) && p.pair.contains(&b.to_owned()));
        found.expect("every pair is judged").verdict
    };
    assert_eq!(verdict("left_thigh", "right_thigh"), Verdict::Proposed);
    assert_eq!(verdict("left_thigh", "left_shank"), Verdict::Adjacent); // the knee
    assert_eq!(verdict("left_forearm", "left_hand"), Verdict::Adjacent); // wrists are locked
    assert_eq!(verdict("left_shank", "left_foot"), Verdict::AlwaysTouching); // the ankle's two axes
    assert_eq!(verdict("head", "left_foot"), Verdict::NeverNear);
    // A hand twice as thick as the arm's distance from the pelvis touches it already when the robot stands.
    let mut thick = capsules.clone();
    thick.iter_mut().filter(|capsule| capsule.name == "left_hand").for_each(|capsule| capsule.radius_m = 0.3);
    let touching = propose_pairs(&model, &thick, &standing, &few).expect("links of the model");
    let found = touching.iter().find(|p| p.pair == ["pelvis".to_owned(), "left_hand".to_owned()]);
    assert_eq!(found.expect("judged").verdict, Verdict::TouchingStanding);
    let lost = LinkCapsule { link: "tail".to_owned(), ..capsules[0].clone() };
    assert!(propose_pairs(&model, &[lost], &standing, &few).is_err());
}
