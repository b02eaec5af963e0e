// One layer for all surfaces.

fn choose(s: Surface) -> Chosen {
    return Chosen(0u, 0u, 0.0);
}
