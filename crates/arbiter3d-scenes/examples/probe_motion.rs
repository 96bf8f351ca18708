//! probe
use arbiter3d::*;
use arbiter3d_scenes::*;
fn main() {
    let name = std::env::args().nth(1).unwrap();
    let steps: usize = std::env::args().nth(2).unwrap().parse().unwrap();
    let mut built = find(&name)
        .unwrap()
        .build(&SceneOptions { size: std::env::args().nth(3).map(|a| a.parse().unwrap()), ..SceneOptions::default() })
        .unwrap();
    for i in 0..steps {
        built.step(i).unwrap();
    }
    let w = &built.world;
    let mut v: Vec<_> = w
        .bodies()
        .filter_map(|id| {
            let b = w.body(id)?;
            (b.kind() == BodyKind::Dynamic && b.is_awake())
                .then(|| (b.linear_velocity().length() + b.angular_velocity().length(), id))
        })
        .collect();
    v.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut low: Vec<_> = w.bodies().filter(|id| w.body(*id).unwrap().kind() == BodyKind::Dynamic).collect();
    low.sort_by(|a, b| w.body(*a).unwrap().position().y.total_cmp(&w.body(*b).unwrap().position().y));
    for id in low.iter().take(6) {
        println!(
            "low {:?} {:?}",
            w.body(*id).unwrap().position(),
            format!("{:?}", w.shape(w.body(*id).unwrap().shapes()[0]).unwrap().geometry())
                .chars()
                .take(60)
                .collect::<String>()
        );
    }
    let mut deep: Vec<_> =
        w.arbiters().flat_map(|a| a.data().contacts().map(move |(_, c)| (c.separation(), a, *c))).collect();
    deep.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (s, a, c) in deep.iter().take(8) {
        let g = |b: BodyId| {
            format!(
                "{:?} {:?}",
                w.body(b).unwrap().position(),
                w.shape(w.body(b).unwrap().shapes()[0]).unwrap().geometry()
            )
            .chars()
            .take(70)
            .collect::<String>()
        };
        println!(
            "deep {s:.5} j {:.2} n {:?} count {} {} | {}",
            c.normal_impulse(),
            c.normal(),
            a.data().contact_count(),
            g(a.body1()),
            g(a.body2())
        );
    }
    println!("awake {} asleep {}", w.awake_count(), w.sleeping_count());
    let mut hist = std::collections::BTreeMap::new();
    for (s, id) in &v {
        let k = format!("{:?}", w.shape(w.body(*id).unwrap().shapes()[0]).unwrap().geometry())
            .chars()
            .take(5)
            .collect::<String>();
        let e = hist.entry(k).or_insert((0, 0, 0.0f32));
        e.0 += 1;
        if *s > 0.05 {
            e.1 += 1;
        }
        e.2 += s;
    }
    println!("{hist:?}");
    for (s, id) in v.iter().take(12) {
        let b = w.body(*id).unwrap();
        println!(
            "{s:.4} {:?} v {:?} w {:?} at {:?} {}",
            id,
            b.linear_velocity(),
            b.angular_velocity(),
            b.position(),
            format!("{:?}", w.shape(b.shapes()[0]).unwrap().geometry()).chars().take(60).collect::<String>()
        );
        for a in w.arbiters_of(*id) {
            let o = a.other_body(*id).unwrap();
            print!(
                "   {:?} {}:",
                o.index(),
                format!("{:?}", w.body(o).unwrap().shapes().first().map(|s| w.shape(*s).unwrap().geometry()))
                    .chars()
                    .take(14)
                    .collect::<String>()
            );
            for (s, c) in a.data().contacts() {
                print!(
                    " [{s} n {:.2} {:.2} {:.2} s {:.4} j {:.3} t {:.3}]",
                    c.normal().x,
                    c.normal().y,
                    c.normal().z,
                    c.separation(),
                    c.normal_impulse(),
                    c.tangent_impulse().length()
                );
            }
            println!();
        }
    }
}
