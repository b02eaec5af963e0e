//! Tables of Markdown pages: measured by the command that stands above them, the rest of the page left alone.

use crate::common::{ok, shadowscope};
use serde_json::Value;

const ABOVE: &str = "# Filters\r\n\nHand-written:\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n```md\n\
                     <!-- shadowscope table nonsense -->\n| kept |\n```\n\n";
const FIRST: &str = "<!-- shadowscope table cubes --size 96x54 --set resolution=128 \\\n  \
                     --rows 'shadow-map,pcf:kernel=5,pcf:mode=disk;samples=9,rt-hard' \\\n  \
                     --columns rmse,rmse_hard,beyond_tolerance,error_share,shadow_incorrect,rays,gpu_bytes,m_p95 -->\n";
const BETWEEN: &str = "\nMeasured by hand: nothing.\n\n  indented\n";
const SECOND: &str =
    "<!-- shadowscope table cubes --size 96x54 --truth-samples 1 --rows pcf --columns rmse,ratio,cost -->\n";
const BELOW: &str = "Directly below, without a line's end";

/// The cells of the n-th table that `tables` wrote, without the rule below the headings.
fn cells(page: &str, comment: &str) -> Vec<Vec<String>> {
    let table = page.split_once(comment).unwrap().1.lines().take_while(|l| l.starts_with('|'));
    let cells = |l: &str| l.trim_matches('|').split('|').map(|c| c.trim().to_string()).collect::<Vec<_>>();
    table.map(cells).filter(|c| c[0] != "---").collect()
}

#[test]
fn a_page_gets_the_figures_that_measure_tells_and_keeps_all_else() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let read = || std::fs::read_to_string(folder.join("page.md")).unwrap();
    std::fs::write(folder.join("page.md"), [ABOVE, FIRST, BETWEEN, SECOND, BELOW].concat()).unwrap();
    ok(folder, &["tables", "page.md"]);
    let page = read();

    // The same numbers as measured and rounded by hand.
    let json = |sets: &[&str], technique: &str| {
        let args = ["measure", "cubes", "--size", "96x54", "--techniques", technique, "--json"];
        let out = ok(folder, &[&args[..], sets].concat());
        serde_json::from_slice::<Value>(&out.stdout).unwrap()[0].clone()
    };
    let small = "--set=resolution=128";
    let rows = [
        json(&[small], "shadow-map"),
        json(&[small, "--set=kernel=5"], "pcf"),
        json(&[small, "--set=mode=disk", "--set=samples=9"], "pcf"),
        json(&[], "rt-hard"),
    ];
    let table = cells(&page, FIRST);
    let names =
        ["", "RMSE", "RMSE, one sample", "off > 0.1, %", "error, %", "shadow wrong", "rays", "MiB", "m p95, px"];
    assert_eq!(table[0], names);
    let labels = ["`shadow-map`", "`pcf`, `kernel = 5`", "`pcf`, `mode = disk`, `samples = 9`", "`rt-hard`"];
    assert_eq!(table[1..].iter().map(|r| r[0].as_str()).collect::<Vec<_>>(), labels);
    let fields = [
        ("rmse", 1.0),
        ("rmse_hard", 1.0),
        ("beyond_tolerance", 100.0),
        ("error_share", 100.0),
        ("shadow_incorrect", 1.0),
        ("rays", 1.0),
        ("gpu_bytes", 1.0 / 1048576.0),
        ("m_p95", 1.0),
    ];
    for (row, told) in rows.iter().zip(&table[1..]) {
        for ((field, scale), cell) in fields.iter().zip(&told[1..]) {
            match row[field].as_f64() {
                // Three digits that count; counts whole.
                Some(v) => {
                    let (v, shown) = (v * scale, cell.parse::<f64>().unwrap());
                    assert!((shown - v).abs() <= 0.005 * v.abs() + 1e-12, "{}: {field} {v}, {cell}", told[0]);
                    let digits = cell.replace('.', "");
                    let whole = ["shadow_incorrect", "rays"].contains(field);
                    assert!(whole && shown == v || digits.trim_start_matches('0').len() <= 3, "{field}: {cell}");
                }
                None => assert_eq!(cell, "–", "{field}"),
            }
        }
    }
    assert!(table[4][2] == "0" && table[4][1] != "0", "{:?}: exact against one sample only", table[4]);
    let times: Vec<f64> = cells(&page, SECOND)[1][1..].iter().map(|c| c.parse().unwrap()).collect();
    assert!(times.iter().all(|t| *t > 0.0), "{times:?}");

    // What was written is said, and what no command wrote is there to the byte.
    let mut rest = page.as_str();
    let mut measured = Vec::new();
    for (known, end) in [([ABOVE, FIRST].concat(), BETWEEN), ([BETWEEN, SECOND].concat(), BELOW), (BELOW.into(), "")] {
        rest = rest.strip_prefix(known.as_str()).unwrap_or_else(|| panic!("{rest}\nlacks\n{known}"));
        let at = rest.find(end).unwrap();
        measured.push(&rest[..at]);
        rest = &rest[at..];
    }
    assert_eq!(measured[2], "");
    assert!(
        measured[0].contains("\n\nMeasured on ") && measured[0].ends_with("16 samples per pixel.\n"),
        "{measured:?}"
    );
    assert!(measured[1].contains(": `cubes`, 96 × 54 pixels, averaged truth of one sample per pixel.\n\n"));

    // Again: the same but for times.
    ok(folder, &["tables", "page.md"]);
    let again = read();
    let still = |page: &str| {
        let (above, rest) = page.split_once(SECOND).unwrap();
        let rest: Vec<&str> = rest.lines().filter(|l| !l.starts_with("| `pcf`")).collect();
        (above.to_string(), rest.join("\n"))
    };
    assert_eq!(still(&again), still(&page));
    assert!(!folder.join("page.md.new").exists());
    // Alone the command prints what the page gets.
    let words = shlex::split(SECOND.trim().trim_start_matches("<!-- shadowscope").trim_end_matches("-->")).unwrap();
    let out = ok(folder, &words.iter().map(String::as_str).collect::<Vec<_>>());
    let alone = String::from_utf8(out.stdout).unwrap();
    assert_eq!(cells(&format!("x\n{alone}"), "x\n")[1][1], cells(&again, SECOND)[1][1]);
}

/// Whatever is wrong is one sentence, and leaves the page as it was.
#[test]
fn wrong_tables_are_refused_before_anything_is_measured() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let refused = |page: &str| {
        std::fs::write(folder.join("page.md"), page).unwrap();
        let out = shadowscope(folder, &["tables", "page.md"]);
        let said = String::from_utf8_lossy(&out.stderr).lines().last().unwrap_or_default().to_string();
        assert_eq!(out.status.code(), Some(1), "{said}");
        assert!(said.starts_with("shadowscope: page.md"), "{said}");
        assert_eq!(std::fs::read_to_string(folder.join("page.md")).unwrap(), page);
        said
    };
    let of = |rest: &str| refused(&format!("\n<!-- shadowscope table cubes --size 96x54 {rest} -->\n| old |\n"));
    assert!(refused("| no | commands |\n").contains("has no table"));
    assert!(refused("<!-- shadowscope table cubes\n").contains("line 1: the comment has no end"));
    assert!(of("--rows pcf --columns rsme").contains("line 2: rsme: there is no such column; there are error_share, "));
    assert!(of("--rows pfc --columns rmse").contains("pfc"));
    assert!(of("--rows pcf:kernle=3 --columns rmse").contains("pcf has no parameter kernle; there are "));
    assert!(of("--rows pcf:kernel=4 --columns rmse").contains("pcf.kernel"));
    assert!(of("--rows 'pcf:mode=disk;kernel=5' --columns rmse").contains("kernel means nothing"));
    assert!(of("--rows pcf:kernel --columns rmse").contains("write kernel as key=value"));
    assert!(of("--rows 'pcf --columns rmse").contains("quotation mark"));
    assert!(of("--columns rmse").contains("--rows"));
    assert!(of("--rows pcf --columns rmse --colour red").contains("--colour"));
    assert!(of("--rows pssm --columns rmse --light omni").contains("omni"));
    assert!(refused("<!-- shadowscope table nowhere --rows pcf --columns rmse -->").contains("nowhere"));
    let out = shadowscope(folder, &["tables", "absent.md"]);
    assert!(String::from_utf8_lossy(&out.stderr).starts_with("shadowscope: absent.md cannot be read"));
    // An adapter that is a program measures no time that would say something.
    let list: Value = serde_json::from_slice(&ok(folder, &["list", "adapters", "--json"]).stdout).unwrap();
    if list[0]["software"] == true {
        assert!(of("--rows pcf --columns gpu_ms").contains("software"));
    }
}
