//! The course's parameter files, and its data where it is present.

use std::{fs, path::PathBuf};

use nappe_scene::{
    Mesh, NoMeshes, Scene, SceneError, SceneLimits,
    course::{
        CourseObject, MecasimOptions, ObjectIntegration, ObjectParameters, SimuParameters, Viscosity,
        mecasim_scene,
    },
    files::{self, Folder, ReadOptions},
    mesh::{EtiOptions, course_grid, write_eti},
};
use nappe_sim::cloth::Integrator;

const SIMU: &str =
    "NbIter=100;  \n\nGX=0.0;\ngy=-9.8;\n#Gy=1;\nGz=0;\nviscosite=0.995;\nobjet1=MSS;\nobjet1=mss;\n";
const OBJECT: &str = "#Points=./other/points.eti;\nPoints=./data/drap4/points.eti;  \nFaceSet=./data/drap4/faceset.eti; \nMasses=./data/drap4/masses.eti;\nTextures=./data/drap4/texcoord.eti;\nk=15000.0;\nnu=0.01;\nrho0=1000;\nh=0.05;\ndt=0.0025;\nIntegration=explicite;\nNbIterVitImpl=5;\nInteraction=yes;\nUseTexture=1;\n";

fn simu(text: &str) -> Result<SimuParameters, SceneError> {
    SimuParameters::parse(text, "a.simu")
}

fn object(text: &str) -> Result<ObjectParameters, SceneError> {
    ObjectParameters::parse(text, "a.objet")
}

fn scene(
    simu_text: &str,
    objects: &[&str],
    options: MecasimOptions,
) -> Result<(Scene, Vec<String>), SceneError> {
    let parameters: Vec<ObjectParameters> =
        objects.iter().map(|text| object(text)).collect::<Result<_, _>>()?;
    let mesh = Mesh::CourseGrid { course_grid: 4 };
    let objects: Vec<CourseObject<'_>> =
        parameters.iter().map(|parameters| CourseObject { parameters, mesh: &mesh }).collect();
    mecasim_scene(&simu(simu_text)?, &objects, &options)
}

#[test]
fn the_files_become_a_scene() {
    let (scene, warnings) = scene(SIMU, &[OBJECT], MecasimOptions::default()).unwrap();
    let body = &scene.bodies[0];
    let springs = body.springs.as_ref().unwrap();
    assert_eq!((scene.dt, scene.steps, scene.gravity), (0.0025, 100, [0.0, -9.8, 0.0]));
    let stretch = springs.stretch.expect("springs of stretch");
    assert_eq!((stretch.stiffness, stretch.damping, body.drag), (15000.0, 0.01, 0.0));
    assert_eq!(
        (body.name.as_str(), body.integrator, body.substeps),
        ("drap4", Integrator::SymplecticEuler, None)
    );
    for wanted in [
        "a.simu:9: objet1 was 'MSS' in line 8: the last value wins",
        "a.simu: viscosite=0.995 is read and left unused",
        "a.objet: rho0, h: for sph and rigid objects, unused here",
    ] {
        assert!(warnings.iter().any(|warning| warning.starts_with(wanted)), "{wanted}\n{warnings:#?}");
    }
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap();
    // Rows 12, columns 12, diagonals 9.
    assert_eq!(built.setup.bodies[0].network.springs.len(), 33);
    assert_eq!(Scene::parse(&scene.to_toml(), "again").unwrap(), scene);
}

#[test]
fn options_and_kinds_change_what_they_say() {
    let drag = MecasimOptions { viscosity: Viscosity::Drag, ..MecasimOptions::default() };
    assert_eq!(scene(SIMU, &[OBJECT], drag).unwrap().0.bodies[0].drag, 0.995);
    let implicit = OBJECT.replace("explicite", "Implicite");
    assert_eq!(
        object(&implicit).unwrap().integration,
        ObjectIntegration::ImplicitEuler { iterations: Some(5) }
    );
    let made = scene(SIMU, &[&implicit], MecasimOptions::default()).unwrap().0;
    assert_eq!(made.bodies[0].integrator, Integrator::ImplicitEuler);
    assert_eq!(made.bodies[0].solver.fixed_iterations, Some(5));
    let chosen = |text: &str, integrator| {
        let options = MecasimOptions { integrator: Some(integrator), ..MecasimOptions::default() };
        let body = scene(SIMU, &[text], options).unwrap().0.bodies.remove(0);
        (body.integrator, body.solver.fixed_iterations)
    };
    assert_eq!(chosen(&implicit, Integrator::Bdf2), (Integrator::Bdf2, Some(5)));
    assert_eq!(chosen(&implicit, Integrator::VelocityVerlet), (Integrator::VelocityVerlet, None));
    assert_eq!(chosen(OBJECT, Integrator::Bdf2), (Integrator::Bdf2, None), "its file says explicite");
    let dust = SIMU.replace("objet1=mss", "objet1=particule");
    assert!(scene(&dust, &[OBJECT], MecasimOptions::default()).unwrap().0.bodies[0].springs.is_none());
    let plain = OBJECT.replace("UseTexture=1", "UseTexture=0");
    assert_eq!(object(&plain).unwrap().textures, None);
}

#[test]
fn two_objects_share_one_clock() {
    let slow = OBJECT.replace("dt=0.0025", "dt=0.005");
    let (made, warnings) = scene(SIMU, &[OBJECT, &slow], MecasimOptions::default()).unwrap();
    assert_eq!(made.dt, 0.005);
    assert_eq!(made.bodies.iter().map(|b| b.substeps).collect::<Vec<_>>(), [Some(2), None]);
    assert_eq!(made.bodies[1].name, "drap4-2");
    assert!(warnings.contains(&"a.simu: objet2 is not set: mss is taken".to_owned()));
    let odd = OBJECT.replace("dt=0.0025", "dt=0.004");
    let error = scene(SIMU, &[OBJECT, &odd], MecasimOptions::default()).unwrap_err().to_string();
    assert!(
        error.starts_with("a.objet: dt: is 0.0025, and the largest, of a.objet, is 0.004: 1.6 times as long"),
        "{error}"
    );
}

#[test]
fn every_error_of_parameter_files_is_named() {
    for (old, new, wanted) in [
        ("k=15000.0;", "k;", "a.objet:6: is 'k;'; allowed: Key=value; or a line that starts with #"),
        ("k=15000.0;", "k=stiff;", "a.objet:6: k: the value is 'stiff'; allowed: a finite number"),
        ("k=15000.0;", "", "a.objet: k: is missing: the stiffness (N/m) of the springs of an mss object"),
        ("nu=0.01;", "", "a.objet: nu: is missing: the damping (N s/m)"),
        ("dt=0.0025;", "", "a.objet: dt: is missing: the time step (s)"),
        ("dt=0.0025;", "dt=0;", "a.objet:10: dt: is 0; allowed: a number of seconds above 0"),
        ("explicite", "leapfrog", "a.objet:11: Integration: is 'leapfrog'; allowed: explicite, implicite"),
        ("Integration=explicite;", "", "a.objet: Integration: is missing: explicite or implicite"),
        (
            "NbIterVitImpl=5",
            "NbIterVitImpl=0",
            "a.objet:12: NbIterVitImpl: is 0; allowed: a whole number, 1 to 1000000",
        ),
        ("NbIterVitImpl=5", "NbIterVitImpl=x", "a.objet:12: NbIterVitImpl: is 'x'; allowed: a whole number"),
        ("UseTexture=1", "UseTexture=maybe", "a.objet:14: UseTexture: is 'maybe'; allowed: yes, no, 1, 0"),
        ("\nPoints=", "\nPoint=", "a.objet: Points: is missing: the file of the points"),
        ("Masses=", "Mases=", "a.objet: Masses: is missing: the file of the masses"),
        ("FaceSet=", "Faces=", "a.objet: FaceSet: is missing: the springs of an mss object"),
    ] {
        let text = OBJECT.replace(old, new);
        assert_ne!(text, OBJECT);
        let found = scene(SIMU, &[&text], MecasimOptions::default()).unwrap_err().to_string();
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
    for (old, new, wanted) in [
        (
            "objet1=mss",
            "objet1=sph",
            "a.simu:9: objet1: is sph, which is not done here; allowed: mss, particule",
        ),
        ("objet1=mss", "objet1=rigid", "a.simu:9: objet1: is rigid, which is not done here"),
        ("objet1=mss", "objet1=wool", "a.simu:9: objet1: is 'wool'; allowed: mss, particule"),
        ("NbIter=100", "NbIter=-1", "a.simu:1: NbIter: is '-1'; allowed: a whole number"),
    ] {
        let found =
            scene(&SIMU.replace(old, new), &[OBJECT], MecasimOptions::default()).unwrap_err().to_string();
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
    let none = scene(SIMU, &[], MecasimOptions::default()).unwrap_err().to_string();
    assert!(none.starts_with("a.simu: has no objects"), "{none}");
}

#[test]
fn odd_lines_give_warnings() {
    let read = simu("NbItr=3;\nGx=1\nGy=2; and more\n").unwrap();
    for wanted in [
        "a.simu:2: the line has no ';'",
        "a.simu:3: 'and more' after the ';' is ignored",
        "a.simu: Gz is missing: 0 is taken",
        "a.simu: NbIter is missing: the simulation does not end by itself",
        "a.simu:1: unknown key 'NbItr' is ignored; did you mean 'NbIter'?",
    ] {
        assert!(read.warnings.contains(&wanted.to_owned()), "{wanted}\n{:#?}", read.warnings);
    }
}

/// The course's folder, where it is present.
#[allow(clippy::print_stderr, reason = "a skipped test says so")]
fn course() -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/course");
    if folder.join("data").is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: the course's data is not beside the project (../shared/course)");
    None
}

#[test]
fn the_formula_reproduces_the_courses_grids_byte_for_byte() {
    let Some(course) = course() else { return };
    for side in [10, 70] {
        let folder = course.join(format!("data/drap{side}"));
        let written = write_eti(&course_grid(side, side, 0.1));
        let texts = [
            ("points.eti", written.points),
            ("faceset.eti", written.faceset),
            ("masses.eti", written.masses.unwrap()),
            ("texcoord.eti", written.texcoord.unwrap()),
        ];
        for (name, text) in texts {
            let theirs = fs::read_to_string(folder.join(name)).unwrap();
            assert!(text == theirs, "drap{side}/{name} differs");
        }
        let loaded = files::load_mesh(&folder, &ReadOptions::default()).unwrap();
        assert_eq!(loaded.mesh, course_grid(side, side, 0.1), "drap{side} by formula");
    }
}

#[test]
fn the_courses_objects_are_read_and_pull_is_refused_until_its_mass_is_given() {
    let Some(course) = course() else { return };
    let sizes = [
        ("drap4", 16, 18),
        ("drap10", 100, 162),
        ("drap70", 4900, 9522),
        ("vache", 4315, 8627),
        ("sphere", 162, 320),
        ("bunny", 435, 851),
        ("pantalon", 943, 1824),
    ];
    for (name, points, triangles) in sizes {
        let loaded = files::load_mesh(&course.join("data").join(name), &ReadOptions::default()).unwrap();
        assert_eq!((loaded.mesh.points.len(), loaded.mesh.triangles.len()), (points, triangles), "{name}");
        assert_eq!(loaded.mesh.masses.len(), points, "{name}");
        loaded.mesh.check().unwrap();
    }
    let pull = course.join("data/pull/points.eti");
    let error = files::load_mesh(&pull, &ReadOptions::default()).unwrap_err().to_string();
    assert!(
        error.contains("masses.eti:1468: holds 1467 masses") && error.contains("for 1468 points"),
        "{error}"
    );
    let options = ReadOptions { eti: EtiOptions { missing_mass: Some(1.0) }, ..ReadOptions::default() };
    let loaded = files::load_mesh(&pull, &options).unwrap();
    assert_eq!(loaded.mesh.masses, vec![1.0; 1468]);
    assert_eq!(loaded.warnings.len(), 1);
}

#[test]
fn the_courses_command_line_becomes_a_scene_that_builds() {
    let Some(course) = course() else { return };
    let simu = files::load_simu(&course.join("exec/Fichier_Param.simu")).unwrap();
    let parameters = ["objet1", "objet2"].map(|name| {
        files::load_object_parameters(&course.join(format!("exec/Fichier_Param.{name}"))).unwrap()
    });
    let meshes = parameters.each_ref().map(|object| {
        files::load_object(object, &course, &ReadOptions::default()).unwrap();
        Mesh::file(object.points.clone())
    });
    let objects: Vec<CourseObject<'_>> =
        parameters.iter().zip(&meshes).map(|(parameters, mesh)| CourseObject { parameters, mesh }).collect();
    let (scene, _) = mecasim_scene(&simu, &objects, &MecasimOptions::default()).unwrap();
    assert_eq!((scene.dt, scene.bodies[0].substeps, scene.bodies[1].substeps), (0.005, Some(2), None));
    let folder = Folder { folder: course, options: ReadOptions::default() };
    let built = scene.build(&folder, &SceneLimits::default()).unwrap();
    assert_eq!(built.setup.bodies[0].network.springs.len(), 14_421);
    assert_eq!(built.setup.gravity, [0.0, -9.8, 0.0]);
}
