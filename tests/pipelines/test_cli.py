"""The command line: one line an error, codes that scripts can use."""

import pytest

from pipelines.cli import COMMANDS, main


def error_line(capsys):
    err = capsys.readouterr().err
    assert err.startswith("undergrowth: error: ")
    assert err.count("\n") == 1
    return err


def test_help_lists_the_commands(capsys):
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in COMMANDS)
    assert main([]) == 2


def test_an_unknown_command_lists_the_known(capsys):
    assert main(["generat"]) == 2
    assert "known are demo, generate, join, inspect" in error_line(capsys)


@pytest.mark.parametrize("command", ["inspect", "verify"])
def test_a_folder_that_is_no_corpus_is_told(command, tmp_path, capsys):
    assert main([command, str(tmp_path)]) == 1
    assert "is not a corpus: it has no corpus.json" in error_line(capsys)


def test_a_wrong_option_ends_with_code_2(tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        main(["verify", str(tmp_path), "--fast"])
    assert caught.value.code == 2


def test_an_interrupt_ends_quietly(monkeypatch, toy_corpus, capsys):
    def interrupted(self):
        raise KeyboardInterrupt

    monkeypatch.setattr("pipelines.commands.verify.VerifySettings.run", interrupted)
    assert main(["verify", str(toy_corpus.path)]) == 130
    assert capsys.readouterr().err == "undergrowth: interrupted\n"
