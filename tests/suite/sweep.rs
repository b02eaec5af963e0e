//! Sweeps from outside: one order, parts that join, work that is not lost, times that can be believed, advice.

use crate::common::{built_in, ok, rising, select, shadowscope, within};
use serde_json::Value;
use shadowscope::measure::{self, More, Record, Step};
use std::path::Path;
use std::process::Output;

/// The message of a refusal: one line.
fn refused(folder: &Path, args: &[&str]) -> String {
    let out = shadowscope(folder, args);
    assert_eq!(out.status.code(), Some(1), "{args:?}");
    let text = String::from_utf8_lossy(&out.stderr).lines().last().unwrap_or_default().to_string();
    assert!(text.starts_with("shadowscope: "), "{text}");
    text
}

const SMALL: [&str; 7] =
    ["sweep", "cubes", "--size", "96x54", "--techniques", "shadow-map,pcf,rt-hard", "--set=resolution=128..512*2"];

fn sweep(folder: &Path, more: &[&str]) -> Output {
    ok(folder, &[&SMALL[..], more].concat())
}

fn rows(folder: &Path, name: &str) -> Vec<Record> {
    measure::read(&folder.join(name)).unwrap()
}

/// What does not depend on speed.
fn still(rows: &[Record]) -> Vec<Record> {
    let still = |r: &Record| Record {
        gpu_ms: 0.0,
        gpu_ms_q1: 0.0,
        gpu_ms_q3: 0.0,
        gpu_ms_low: 0.0,
        gpu_ms_high: 0.0,
        frames: 0,
        ratio: None,
        cost: None,
        cpu_ms: 0.0,
        passes: String::new(),
        ..r.clone()
    };
    rows.iter().map(still).collect()
}

/// What is said of progress never falls, whatever fails on the way, and each configuration ends as a row or as a failure.
#[test]
fn progress_rises_to_the_end() {
    let (mut renderer, setup) = built_in("cubes", [64, 36]);
    let with = |technique: &str, resolution: i64| {
        let mut s = setup.clone();
        select(&mut s, technique, &[&format!("resolution={resolution}")]);
        (0, s)
    };
    // The cube serves no sun.
    let work = [with("shadow-map", 128), with("cube", 128), with("shadow-map", 256), with("pcf", 128)];
    let (mut rising, mut last, mut ended) = (rising(), 0.0, Vec::new());
    measure::run(&mut renderer, &setup, &work, 4, More::default(), &mut |step| {
        match step {
            Step::Working(share, _) => {
                last = share;
                rising(share);
            }
            Step::Row(row) => ended.push(row.technique),
            Step::Failed(e) => ended.push(format!("{e:#}")),
        }
        true
    })
    .unwrap();
    ended.sort();
    assert!(ended[0].starts_with("cube") && ended[0].contains("directional"), "{ended:?}");
    assert_eq!(ended[1..], ["pcf", "shadow-map", "shadow-map"]);
    assert!(last > 0.9, "{last}");
}

#[test]
fn parts_join_to_the_whole_and_json_says_the_same_as_csv() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    sweep(folder, &["-o", "all.csv"]);
    let all = rows(folder, "all.csv");
    let told: Vec<String> = all
        .iter()
        .map(|r| {
            let resolution =
                r.values().into_iter().find(|(n, _)| *n == "resolution").map_or("", |(_, v)| v).to_string();
            format!("{} {} {resolution}", r.index, r.technique)
        })
        .collect();
    assert_eq!(
        told,
        [
            "0 shadow-map 128",
            "1 shadow-map 256",
            "2 shadow-map 512",
            "3 pcf 128",
            "4 pcf 256",
            "5 pcf 512",
            "6 rt-hard "
        ]
    );
    // Coarser maps are worse, the exact technique is exact, and the baseline costs as much as itself.
    assert!(all[0].error_share > all[2].error_share && all[6].error_share == 0.0);
    assert!(all[..3].iter().all(|r| r.ratio == Some(1.0)) && all[5].ratio_resolution == Some(512));
    assert_eq!(all[4].ratio, Some(all[4].gpu_ms / all[1].gpu_ms), "timed in turn with the map of its resolution");
    assert_eq!((all[6].ratio_resolution, all[6].ratio.is_some()), (Some(1024), true));
    assert!(all.iter().all(|r| r.frames >= 11 && r.gpu_ms_low <= r.gpu_ms && r.gpu_ms <= r.gpu_ms_high));

    for part in ["1/3", "2/3", "3/3"] {
        sweep(folder, &["-o", &format!("{}.json", &part[..1]), "--shard", part]);
    }
    assert_eq!(rows(folder, "2.json").iter().map(|r| r.index).collect::<Vec<_>>(), [1, 4]);
    ok(folder, &["merge", "3.json", "1.json", "2.json", "-o", "joined.csv"]);
    assert_eq!(still(&rows(folder, "joined.csv")), still(&all));
    ok(folder, &["merge", "joined.csv", "-o", "joined.json"]);
    assert_eq!(rows(folder, "joined.json"), rows(folder, "joined.csv"));
    let names = std::fs::read_to_string(folder.join("joined.csv")).unwrap();
    let text = std::fs::read(folder.join("joined.json")).unwrap();
    let json: Value = serde_json::from_slice(&text).unwrap();
    let mut names: Vec<&str> = names.lines().next().unwrap().split(',').collect();
    names.sort_unstable();
    assert_eq!(json[0].as_object().unwrap().keys().map(String::as_str).collect::<Vec<_>>(), names);

    let out = shadowscope(folder, &["merge", "3.json", "1.json", "-o", "gap.csv"]);
    assert_eq!((out.status.code(), rows(folder, "gap.csv").len()), (Some(1), 5));
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(said.contains("2 of 7 configurations are missing: 1, 4"), "{said}");
    // Every row can be drawn again from its set-up.
    assert_eq!(all[4].setup().unwrap().values()["resolution"].to_string(), "256");
}

#[test]
fn an_interrupted_sweep_goes_on_where_it_stopped() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    sweep(folder, &["-o", "whole.csv"]);
    let whole = std::fs::read_to_string(folder.join("whole.csv")).unwrap();
    // As if it had been stopped while the third row was written.
    let cut = whole.lines().take(3).map(str::len).sum::<usize>() + 3 + 40;
    std::fs::write(folder.join("a.csv.partial"), &whole[..cut]).unwrap();
    let out = sweep(folder, &["-o", "a.csv"]);
    assert!(String::from_utf8_lossy(&out.stderr).contains("2 of 7 configurations are measured already"));
    let (old, new) = (rows(folder, "whole.csv"), rows(folder, "a.csv"));
    assert_eq!(new[..2], old[..2], "rows that were there stay as they were, times too");
    assert_eq!(still(&new), still(&old));
    assert!(!folder.join("a.csv.partial").exists());

    // Cut inside its last column, or begun beside an incomplete result: what is whole counts.
    std::fs::write(folder.join("b.csv.partial"), &whole[..whole.len() - 300]).unwrap();
    measure::write(&old[..1], &folder.join("b.csv"), false).unwrap();
    let out = sweep(folder, &["-o", "b.csv"]);
    assert!(String::from_utf8_lossy(&out.stderr).contains("6 of 7 configurations are measured already"));
    assert_eq!(rows(folder, "b.csv")[..6], old[..6]);
    // What was not measured then is now.
    sweep(folder, &["-o", "b.csv", "--flicker"]);
    assert!(rows(folder, "b.csv").iter().all(|r| r.flicker.is_some()));

    // Complete: nothing is measured again, and nothing else is written over it.
    let before = std::fs::read(folder.join("a.csv")).unwrap();
    sweep(folder, &["-o", "a.csv"]);
    assert_eq!(std::fs::read(folder.join("a.csv")).unwrap(), before);
    let message = refused(folder, &[&SMALL[..4], &["--techniques", "pcf", "-o", "a.csv"]].concat());
    assert!(message.contains("holds another sweep"), "{message}");
    assert_eq!(std::fs::read(folder.join("a.csv")).unwrap(), before);
}

#[test]
fn wrong_sweeps_are_refused_in_a_sentence() {
    let dir = tempfile::tempdir().unwrap();
    for (more, says) in [
        (&["-o", "a.txt"][..], "ends in .csv or .json"),
        (&["-o", "a.csv", "--shard", "4/3"], "takes 1 to 3"),
        (&["-o", "a.csv", "--set", "kernel=2"], "steps of 2"),
        (&["-o", "a.csv", "--set", "kernal=3"], "no parameter kernal"),
        (&["-o", "a.csv", "--set", "pcf.kernel=9..3"], "above its end"),
        (&["-o", "a.csv", "--set", "resolution=64..8192*0.5"], "steps do not lead"),
        (&["-o", "a.csv", "--light", "omni"], "2 of 3 configurations could not be measured"),
    ] {
        let message = refused(dir.path(), &[&SMALL[..6], more].concat());
        assert!(message.contains(says), "{more:?}: {message}");
    }
    // Parts of different sweeps, and files without rows, do not join.
    ok(
        dir.path(),
        &["sweep", "cubes", "--size", "32x18", "--techniques", "pcf", "--set=kernel=3,5", "--shard=1/2", "-o", "x.csv"],
    );
    ok(
        dir.path(),
        &["sweep", "cubes", "--size", "48x27", "--techniques", "pcf", "--set=kernel=3,5", "--shard=2/2", "-o", "y.csv"],
    );
    let before = std::fs::read(dir.path().join("x.csv")).unwrap();
    std::fs::write(dir.path().join("empty.csv"), "").unwrap();
    assert!(refused(dir.path(), &["merge", "x.csv", "y.csv", "-o", "x.csv"]).contains("another sweep"));
    assert!(refused(dir.path(), &["merge", "empty.csv", "-o", "x.csv"]).contains("holds no rows"));
    assert_eq!(std::fs::read(dir.path().join("x.csv")).unwrap(), before);
    std::fs::write(dir.path().join("b.csv"), "a,b\n1,2\n").unwrap();
    let message = refused(dir.path(), &["merge", "b.csv", "-o", "c.csv"]);
    assert!(message.contains("b.csv does not hold measured rows"), "{message}");
    assert!(refused(dir.path(), &["reproduce", "nobody-1"]).contains("morais-4"));
}

/// Configurations that do the same work cannot be told apart, and those that do not are in the same order each time.
#[test]
fn times_agree_from_run_to_run() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    // Another bias takes no time.
    let same = ["--set", "resolution=512", "--set", "pcf.bias=0.002,0.003"];
    let run = |name: &str| {
        let args = ["sweep", "cubes", "--size", "192x108", "--techniques", "shadow-map,pcf,notw", "-o", name];
        let out = within(folder, &[&args[..], &same[..]].concat(), "1");
        assert!(out.status.success(), "{out:?}");
        rows(folder, name)
    };
    let (first, second) = (run("1.csv"), run("2.csv"));
    assert!(measure::tied(&first[1], &first[2]), "{:?}", [&first[1].gpu_ms, &first[2].gpu_ms]);
    let mut told_apart = 0;
    for a in 0..first.len() {
        for b in 0..a {
            if !measure::tied(&first[a], &first[b]) && !measure::tied(&second[a], &second[b]) {
                told_apart += 1;
                let faster = |rows: &[Record]| rows[a].gpu_ms < rows[b].gpu_ms;
                assert_eq!(faster(&first), faster(&second), "{} and {}", first[a].technique, first[b].technique);
            }
        }
    }
    assert!(told_apart >= 3, "a counted warp differs from plain maps");
}

#[test]
fn advice_meets_its_budget_or_says_what_comes_closest() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let advise = |more: &[&str]| {
        shadowscope(folder, &[&["advise", "cubes", "--size", "96x54", "--set", "bias=0.001", "--json"], more].concat())
    };
    let some = "shadow-map,pcf,sdsm,lispsm,notw,rt-hard";
    let out = advise(&["--techniques", some, "--by", "error", "--max-error", "0.5%", "-o", "tried.csv"]);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let advice: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!(advice["answer"]["error_share"].as_f64().unwrap() <= 0.005);
    assert!(
        advice["answer"]["params"].as_str().unwrap().contains("bias=0.001")
            || advice["answer"]["technique"] == "rt-hard"
    );
    let tried = rows(folder, "tried.csv");
    let space = advice["space"].as_u64().unwrap() as usize;
    // A third, and up to four shadow maps to compare with.
    assert!(!tried.is_empty() && tried.len() <= space / 3 + 4, "{} of {space}", tried.len());
    let cheaper = tried.iter().filter(|r| r.error_share <= 0.005).map(|r| r.cost.unwrap());
    assert_eq!(advice["answer"]["cost"].as_f64(), cheaper.min_by(f64::total_cmp));
    let plain = tried.iter().filter(|r| r.technique == "shadow-map" && r.error_share <= 0.005).map(|r| r.cost.unwrap());
    let plain = plain.min_by(f64::total_cmp).filter(|_| advice["answer"]["technique"] != "shadow-map");
    assert_eq!(advice["plain"]["cost"].as_f64(), plain);
    let factor = plain.map(|cost| cost / advice["answer"]["cost"].as_f64().unwrap());
    assert_eq!(advice["plain_factor"].as_f64(), factor);

    let out = advise(&["--techniques", "shadow-map,rt-hard", "--max-error", "0", "--max-ratio", "0.01"]);
    assert_eq!(out.status.code(), Some(3), "nothing costs a hundredth of a shadow map");
    let advice: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!(advice["answer"].is_null() && advice["closest"]["technique"].is_string());
    // Before it gives up it tries the finest, and it varies only what was not fixed.
    let coarse = ["--set", "pcf.kernel=5", "--set", "resolution=64..256*2"];
    let out =
        advise(&[&["--techniques", "shadow-map,pcf", "--by", "error", "--max-error", "0.01%"], &coarse[..]].concat());
    assert_eq!(out.status.code(), Some(3));
    let advice: Value = serde_json::from_slice(&out.stdout).unwrap();
    let all: Vec<&str> = advice["tried"].as_array().unwrap().iter().filter_map(|r| r["params"].as_str()).collect();
    assert!(all.iter().any(|p| p.contains("resolution=256")) && advice["space"] == 9, "{all:?}");
    assert!(all.iter().all(|p| !p.contains("kernel=") || p.contains("kernel=5")), "{all:?}");
    let cubes = |more: &[&str]| refused(folder, &[&["advise", "cubes"], more].concat());
    let message = cubes(&["--by", "error", "--max-error", "half"]);
    assert!(message.contains("write it as 0.5% or 0.005"), "{message}");
    // All techniques are asked, and pcf filters.
    let message = cubes(&["--max-error", "0.5%"]);
    assert!(message.contains("RMSE is not a share") && message.contains("--by"), "{message}");
    assert!(cubes(&["--by", "luck", "--max-error", "1"]).contains("error, rmse, "));
    // The error asked for is what is judged, and flicker is measured for it.
    let out =
        advise(&["--techniques", "pcf,rt-hard", "--set", "resolution=256", "--by", "flicker", "--max-error", "0"]);
    let advice: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!((&advice["by"], &advice["answer"]["technique"]), (&"flicker".into(), &"rt-hard".into()));
    assert_eq!(advice["answer"]["flicker"], 0.0);
    assert!(advice["tried"].as_array().unwrap().iter().all(|r| r["flicker"].is_number()), "{advice}");
}

/// The document holds what the command prints now, where that takes seconds, up to what another rasteriser may change, and its pictures are
/// there.
#[test]
fn the_reproductions_document_is_the_commands_output() {
    let dir = tempfile::tempdir().unwrap();
    let ids = [
        "morais-6",
        "kenzel-1.7",
        "kenzel-5.5",
        "navratil-2.17",
        "azri-2.13",
        "navratil-3.7",
        "navratil-3.9",
        "wimmer-n",
        "chong-4.1",
    ];
    let printed = ok(dir.path(), &[&["reproduce"], &ids[..], &["-o", "images"]].concat()).stdout;
    let printed = String::from_utf8(printed).unwrap();
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let kept = std::fs::read_to_string(docs.join("reproductions.md")).unwrap();
    let section = |text: &str, id: &str| {
        let command = format!("\n`shadowscope reproduce {id}`\n");
        let start = text.find(&command).unwrap_or_else(|| panic!("{id} is not there"));
        let rest = &text[start + 1..];
        rest[..rest.find("\n## ").unwrap_or(rest.len())].trim().to_string()
    };
    let words = |text: &str| text.split_whitespace().map(String::from).collect::<Vec<_>>();
    for id in ids {
        let (printed, kept) = (section(&printed, id), section(&kept, id));
        assert_eq!(words(&printed).len(), words(&kept).len(), "{printed}\n\n{kept}");
        for (a, b) in words(&printed).into_iter().zip(words(&kept)) {
            match (a.parse::<f64>(), b.parse::<f64>()) {
                (Ok(x), Ok(y)) => assert!((x - y).abs() <= 0.05 + 0.01 * y.abs(), "{id}: {x} instead of {y}"),
                _ => assert_eq!(a, b, "{id}"),
            }
        }
    }
    let pictures: Vec<&str> =
        kept.match_indices("](images/").filter_map(|(i, _)| kept[i + 2..].split(')').next()).collect();
    assert!(pictures.len() >= 10, "{pictures:?}");
    for picture in pictures {
        assert!(docs.join(picture).is_file(), "{picture} is missing");
    }
    for chart in ["navratil-3.7-parts", "navratil-3.7", "wimmer-n"] {
        let drawn = std::fs::read_to_string(dir.path().join(format!("images/{chart}.svg"))).unwrap();
        assert!(drawn.contains("<svg") && drawn.matches("class=\"line\"").count() >= 3, "{chart}");
    }
}
