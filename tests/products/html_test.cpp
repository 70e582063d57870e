#include "viewer/html.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace seastitch {
namespace {

TEST(Html, EscapesWhatTheBrowserWouldTakeForMarkup) {
  EXPECT_EQ(Escaped("<a href=\"x\">&"), "&lt;a href=&quot;x&quot;&gt;&amp;");
}

TEST(Html, WritesNumbersForPeople) {
  EXPECT_EQ(Fixed(1.2345, 2), "1.23");
  EXPECT_EQ(Fixed(std::numeric_limits<double>::quiet_NaN(), 2), "&ndash;");
  EXPECT_EQ(Grouped(999), "999");
  EXPECT_EQ(Grouped(1234567), "1&#8239;234&#8239;567");
}

TEST(Html, TablesHaveARowForEachCallAndACellForEachString) {
  HtmlTable table({"a", "b"});
  table.Row({"1", "2"});
  EXPECT_EQ(table.Finish(),
            "<table>\n<tr><th>a</th><th>b</th></tr>\n<tr><td>1</td><td>2</td></tr>\n</table>\n");
}

TEST(FillTemplate, PutsValuesIntoTheirPlaces) {
  EXPECT_EQ(FillTemplate("<p>{{a}} and {{b}}, {{a}}</p>", {{"a", "x"}, {"b", "y"}}),
            "<p>x and y, x</p>");
  EXPECT_EQ(FillTemplate("{{none}}!", {}), "!");
}

TEST(FillTemplate, KeepsASectionWhereItsValueIsNotEmpty) {
  const std::string page = "{{#a}}[{{a}}{{#b}}({{b}}){{/b}}]{{/a}}.";
  EXPECT_EQ(FillTemplate(page, {{"a", "x"}, {"b", "y"}}), "[x(y)].");
  EXPECT_EQ(FillTemplate(page, {{"a", "x"}}), "[x].");
  EXPECT_EQ(FillTemplate(page, {{"b", "y"}}), ".");
}

TEST(FillTemplate, LooksNotIntoValues) {
  EXPECT_EQ(FillTemplate("{{a}}", {{"a", "{{b}} {{#c}}"}, {"b", "x"}}), "{{b}} {{#c}}");
}

TEST(FillTemplate, RefusesATemplateThatDoesNotEnd) {
  EXPECT_THROW(FillTemplate("{{#a}}x", {{"a", "y"}}), std::logic_error);
  EXPECT_THROW(FillTemplate("{{a", {}), std::logic_error);
}

}  // namespace
}  // namespace seastitch
