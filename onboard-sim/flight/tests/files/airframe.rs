use flight::vehicles::airframe::{builtin, from_toml};

#[test]
fn an_unknown_key_or_name_is_named_in_the_error() {
    let error = from_toml("motor = 'x'\nwings = 2").unwrap_err().to_string();
    assert!(error.contains("unknown field `wings`"), "{error}");
    let error = builtin("mk9").unwrap_err().to_string();
    assert_eq!(
        error,
        "no airframe is named 'mk9'; these are built in: mk2, mk3, mk2-h53, mini-f10, vlr, vlr-f15, vlr-f16"
    );
}
