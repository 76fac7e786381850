//! Every level of the sole carries the robot.

use plant::{Plant, PlantSoleLevel, PlantSoleSettings};
use sole::SoleSettings;
use spatial::Vec3;

use super::robot;

#[test]
fn the_robot_stands_on_every_level_and_the_foam_sinks_alike() {
    use PlantSoleLevel::{Fem, Lumped, Patches, QuadraticFem, QuadraticPatches, Rigid, Winkler};
    let model = robot::model();
    let ankles = robot::flat_ankles(3e-4);
    let com = Vec3::new(0.0, 0.0, 0.78);
    let q = robot::stand(&model, &ankles, com);
    let command = robot::command(&model, &q, &robot::resting_plan(&model, &q, &ankles, com, [0.5, 0.5]));
    for level in [Rigid, Lumped, Winkler, Patches, Fem, QuadraticFem, QuadraticPatches] {
        let soles = PlantSoleSettings { level, mesh_cells: Some([8, 5, 2]), patch_cells: [5, 4], ..Default::default() };
        let soles = soles.build(&SoleSettings::default()).unwrap();
        let mut settings = robot::settings();
        settings.stabiliser.enabled = level != Rigid;
        let mut plant = Plant::new(settings, robot::model(), soles, &robot::frames()).unwrap();
        plant.place(&q);
        assert!(plant.settle(&command, 5.0).is_some(), "{level:?}: {:?}", plant.truth());
        let sinks = plant.truth().feet.map(|foot| -foot.sole.translation.z);
        // 191 N on about 500 kN/m; linear tetrahedra lock and quadratic ones do not, so the levels differ by a tenth or so.
        let expected = if level == Rigid { 0.0..1e-4 } else { 2.5e-4..5e-4 };
        assert!(sinks.iter().all(|sink| expected.contains(sink)), "{level:?}: {sinks:?}");
        assert_eq!(plant.contact(0).is_some(), level != Rigid);
    }
}
