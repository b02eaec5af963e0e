#!/bin/sh
# Fuzzes one reader: fuzz/run.sh TARGET SECONDS. What it finds lands in fuzz/artifacts/TARGET.
set -eu
cd "$(dirname "$0")/.."
target=$1
seconds=$2
cp Cargo.lock fuzz/Cargo.lock
mkdir -p "fuzz/corpus/$target"
# Beside the corpus of the tests, what else there is of the kind.
case $target in
    gltf) more="tests/data" ;;
    setup) more="assets/gallery" ;;
    results) more="tests/data" ;;
    figure) more="assets/figures" ;;
    lesson) more="assets/lessons" ;;
    *) more="" ;;
esac
dictionary=
[ -f "fuzz/dictionaries/$target" ] && dictionary="-dict=fuzz/dictionaries/$target"
# Each file is in a folder of its own, in memory where there is such a place.
[ -d /dev/shm ] && export TMPDIR=/dev/shm
# Nearly all of it is safe Rust, of which panics, hangs and memory are what there is to find.
# shellcheck disable=SC2086
exec cargo +nightly fuzz run --sanitizer none -O "$target" "fuzz/corpus/$target" "tests/corpus/$target" $more -- \
    $dictionary -max_total_time="$seconds" -timeout=10 -rss_limit_mb=4096 -max_len=65536 -print_final_stats=1
