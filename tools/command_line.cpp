#include "tools/command_line.hpp"

#include <cmath>
#include <sstream>

#include "common/runtime/config/nearest_name.hpp"

namespace seastitch {
namespace {

std::string OrNearest(const std::string& nearest) {
  return nearest.empty() ? std::string() : "; did you mean '" + nearest + "'?";
}

std::vector<std::string> NamesOf(const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> names;
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  return names;
}

std::vector<std::string> OptionsOf(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

CLI::Validator Number(const char* expected, bool (*good)(double)) {
  return CLI::Validator(
      [expected, good](std::string& text) {
        double value = 0.0;
        if (CLI::detail::lexical_cast(text, value) && std::isfinite(value) && good(value))
          return std::string();
        return "'" + text + "': expected a number " + expected;
      },
      "");
}

}  // namespace

const CLI::App* FindCommand(const CLI::App& app, const std::string& name) {
  const auto found =
      app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

std::string UnknownCommand(const CLI::App& app, const std::string& word) {
  return "there is no command '" + word + "'" +
         OrNearest(NearestName(word, NamesOf(app.get_subcommands({})))) +
         " (seastitch --help lists them)";
}

CLI::Validator AboveZero() {
  return Number("above 0", [](double value) { return value > 0.0; });
}

CLI::Validator AtLeastZero() {
  return Number("that is at least 0", [](double value) { return value >= 0.0; });
}

Datum ParseDatum(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += word + " ";
  for (char& c : text)
    if (c == ',') c = ' ';
  std::istringstream in(text);
  Datum datum;
  std::string rest;
  if (in >> datum.latitude_deg >> datum.longitude_deg && !(in >> rest) &&
      std::abs(datum.latitude_deg) <= 90.0 && std::abs(datum.longitude_deg) <= 180.0)
    return datum;
  throw CLI::ValidationError(
      "--datum", "expected latitude and longitude in degrees, such as --datum 43.07,-70.71");
}

std::string Explain(const CLI::App& app, const std::string& name, const CLI::ParseError& error) {
  const CLI::App* const command = FindCommand(app, name);
  const std::string help = " (seastitch help" + (command ? " " + name : std::string()) + ")";
  const std::string said = error.what();
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    const std::string word = said.substr(said.rfind(' ') + 1);
    const std::string nearest =
        command == nullptr ? std::string() : NearestName(word, OptionsOf(*command));
    return "'" + word + "' is no " + (word.starts_with('-') ? "option" : "argument") + " of " +
           name + OrNearest(nearest) + help;
  }
  if (command != nullptr && !command->get_subcommands({}).empty() &&
      dynamic_cast<const CLI::RequiredError*>(&error) != nullptr)
    return name + ": expected one of: " + Joined(NamesOf(command->get_subcommands({}))) + help;
  return said + help;
}

}  // namespace seastitch
