//! Builds a tree with the crate obvhs and prints its cost by AccelScope's definition, as JSON.
//!
//!     obvhs-peer TRIANGLES C_TRAV C_ISECT RADIUS REINSERTION MAX_LEAF
//!
//! TRIANGLES is a file of little-endian f32, nine for each triangle. RADIUS is PLOC's (1, 2, 6, 14,
//! 24 or 32), REINSERTION the share of nodes in the first of the optimiser's 16 rounds (0: none),
//! MAX_LEAF the most triangles of a leaf, which obvhs chooses by the same cost.

use std::time::Instant;

use obvhs::{
    bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
    triangle::Triangle,
};

/// What is printed.
#[derive(Default)]
struct Figures {
    inner: usize,
    leaves: usize,
    references: usize,
    inner_area: f64,
    leaf_area: f64,
}

/// Adds up what is below the root; the areas are relative to its own.
fn measure(bvh: &Bvh2) -> Figures {
    let area = |node: usize| {
        let size = (bvh.nodes[node].aabb().max - bvh.nodes[node].aabb().min).as_dvec3();
        size.x * size.y + size.y * size.z + size.z * size.x
    };
    let mut figures = Figures::default();
    let mut waiting = vec![0];
    while let Some(node) = waiting.pop() {
        let count = bvh.nodes[node].prim_count as usize;
        let share = area(node) / area(0);
        if count > 0 {
            figures.leaves += 1;
            figures.references += count;
            figures.leaf_area += count as f64 * share;
        } else {
            figures.inner += 1;
            figures.inner_area += share;
            let first = bvh.nodes[node].first_index as usize;
            waiting.extend([first, first + 1]);
        }
    }
    figures
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let number = |i: usize| arguments[i].parse::<f64>().expect("a number");
    let bytes = std::fs::read(&arguments[1]).expect("a file of triangles");
    let floats: Vec<f32> = bytes
        .chunks_exact(4)
        .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
        .collect();
    let triangles: Vec<Triangle> = floats
        .chunks_exact(9)
        .map(|nine| Triangle {
            v0: [nine[0], nine[1], nine[2]].into(),
            v1: [nine[3], nine[4], nine[5]].into(),
            v2: [nine[6], nine[7], nine[8]].into(),
        })
        .collect();
    let (c_trav, c_isect) = (number(2), number(3));
    let radius = match number(4) as usize {
        1 => PlocSearchDistance::Minimum,
        2 => PlocSearchDistance::VeryLow,
        6 => PlocSearchDistance::Low,
        14 => PlocSearchDistance::Medium,
        24 => PlocSearchDistance::High,
        32 => PlocSearchDistance::VeryHigh,
        other => panic!("obvhs has no radius {other}"),
    };
    let (reinsertion, max_leaf) = (number(5), number(6));

    let start = Instant::now();
    let indices = (0..triangles.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(triangles.len()).build(
        radius,
        &triangles,
        indices,
        SortPrecision::U64,
        0, // the full radius from the first iteration on
    );
    ReinsertionOptimizer::default().run(&mut bvh, reinsertion as f32, None);
    // obvhs takes the cost of a triangle for 1.
    collapse(&mut bvh, max_leaf as u32, (c_trav / c_isect) as f32);
    let seconds = start.elapsed().as_secs_f64();

    let figures = measure(&bvh);
    let sah = c_trav * figures.inner_area + c_isect * figures.leaf_area;
    println!(
        "{{\"sah\": {sah}, \"N_IN\": {}, \"N_V\": {}, \"N_OIV\": {}, \"seconds\": {seconds}}}",
        figures.inner, figures.leaves, figures.references
    );
}
